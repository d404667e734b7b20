//! SVG drawings of states: dark obstacles, agents as discs, goals as squares, with the letters of the text pictures.

use std::fmt::Write as _;

use pogema_conformance::panel::{Grid, Sign};

/// Side of a cell. Units: pixels.
const CELL: usize = 24;
/// The longest side of a drawing; on larger ones no cell is recognisable. Units: cells.
const MAX_CELLS: usize = 64;

/// Draws a grid and highlights the cells that differ from `other`; returns `None` if the grid is too large.
pub fn drawing(title: &str, grid: &Grid, other: &Grid) -> Option<String> {
    let (height, width) = (grid.len(), grid.first()?.len());
    if height.max(width) > MAX_CELLS {
        return None;
    }
    let [right, bottom] = [width, height].map(|cells| cells * CELL);
    let mut svg = format!(r#"<svg viewBox="-1 -1 {} {}" width="{}" "#, right + 2, bottom + 2, right + 2);
    let _ = write!(
        svg,
        r#"role="img" aria-label="{title}"><rect class="ground" width="{right}" height="{bottom}"/>"#
    );
    let across = (0..=height).map(|row| format!("M0 {}h{right}", row * CELL));
    let down = (0..=width).map(|column| format!("M{} 0v{bottom}", column * CELL));
    let lines: String = across.chain(down).collect();
    let _ = write!(svg, r#"<path class="lines" d="{lines}"/>"#);
    for (row, line) in grid.iter().enumerate() {
        for (column, &sign) in line.iter().enumerate() {
            let differs = other.get(row).is_some_and(|line| line.get(column) != Some(&sign));
            svg.push_str(&cell(column * CELL, row * CELL, sign, differs));
        }
    }
    svg.push_str("</svg>");
    Some(svg)
}

fn cell(x: usize, y: usize, sign: Sign, differs: bool) -> String {
    let square = |class: &str, rim: usize, more: &str| {
        let side = CELL - 2 * rim;
        format!(
            r#"<rect class="{class}" x="{}" y="{}" width="{side}" height="{side}"{more}/>"#,
            x + rim,
            y + rim
        )
    };
    let (middle, centre) = (x + CELL / 2, y + CELL / 2);
    let letter = sign.letter();
    let colour = colour(letter);
    let lettered = |shape: &str, fill: &str| {
        format!(r#"{shape}<text x="{middle}" y="{}" fill="{fill}">{letter}</text>"#, centre + 4)
    };
    let mut shapes = match sign {
        Sign::Obstacle => square("obstacle", 0, ""),
        Sign::Goal(_) => lettered(&square("goal", 4, &format!(r#" stroke="{colour}""#)), &colour),
        Sign::Agent(_) => {
            lettered(&format!(r#"<circle cx="{middle}" cy="{centre}" r="10" fill="{colour}"/>"#), "#fff")
        }
        Sign::Free | Sign::Occupied | Sign::Set => String::new(),
    };
    if differs {
        shapes.push_str(&square("differs", 1, ""));
    }
    shapes
}

/// Returns the colour of an agent and its goal; agents with consecutive letters get very different hues.
fn colour(letter: char) -> String {
    const GOLDEN_ANGLE: usize = 137;
    let hue = letter.to_ascii_lowercase() as usize * GOLDEN_ANGLE % 360;
    format!("hsl({hue} 65% 33%)")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_with_digits_are_drawn_as_squares() {
        let grid = vec![vec![Sign::Agent(26), Sign::Goal(26), Sign::Goal(99)]];
        let svg = drawing("got", &grid, &Grid::new()).unwrap_or_default();
        let shapes = ["<circle", "class=\"goal\"", ">0</text>", ">?</text>", "differs"];
        assert_eq!(shapes.map(|shape| svg.matches(shape).count()), [1, 2, 2, 1, 0]);
    }
}
