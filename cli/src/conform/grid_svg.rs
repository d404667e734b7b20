//! SVG drawings of states: dark obstacles, agents as discs, goals as squares, finished agents as rings. The letters are
//! those of the text pictures, but a finished agent has its own letter instead of `*`. A hidden sign is drawn under the
//! sign that hides it.

use std::fmt::Write as _;

use pogema_conformance::panel::{Covered, Grid, Sign};
use pogema_core::picture::agent_letter;

/// Side of a cell. Units: pixels.
const CELL: usize = 24;
/// Maximum side length of a drawing; cells of larger drawings are not recognisable. Units: cells.
const MAX_CELLS: usize = 64;

/// Draws a grid and highlights the cells that differ from `other`; returns `None` if the grid is empty or too large.
pub fn drawing(title: &str, grid: &Grid, other: &Grid) -> Option<String> {
    let (height, width) = (grid.rows.len(), grid.rows.first()?.len());
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
    for Covered { row, column, under } in &grid.covered {
        for &sign in under.iter().rev() {
            svg.push_str(&shape(column * CELL, row * CELL, sign, false));
        }
    }
    for (row, line) in grid.rows.iter().enumerate() {
        for (column, &sign) in line.iter().enumerate() {
            let (x, y) = (column * CELL, row * CELL);
            svg.push_str(&shape(x, y, sign, true));
            if other.rows.get(row).is_some_and(|line| line.get(column) != Some(&sign)) {
                svg.push_str(&square(x, y, "differs", 1, ""));
            }
        }
    }
    svg.push_str("</svg>");
    Some(svg)
}

fn square(x: usize, y: usize, class: &str, rim: usize, more: &str) -> String {
    let side = CELL - 2 * rim;
    let (x, y) = (x + rim, y + rim);
    format!(r#"<rect class="{class}" x="{x}" y="{y}" width="{side}" height="{side}"{more}/>"#)
}

/// Draws a sign. Only the topmost sign of a cell has its letter.
fn shape(x: usize, y: usize, sign: Sign, has_letter: bool) -> String {
    let (centre_x, centre_y) = (x + CELL / 2, y + CELL / 2);
    let lettered = |shape: String, letter: char, fill: &str| {
        let text = format!(r#"<text x="{centre_x}" y="{}" fill="{fill}">{letter}</text>"#, centre_y + 4);
        if has_letter { shape + &text } else { shape }
    };
    match sign {
        Sign::Obstacle => square(x, y, "obstacle", 0, ""),
        Sign::Goal(agent) => {
            let colour = colour(agent);
            let shape = square(x, y, "goal", 4, &format!(r#" stroke="{colour}""#));
            lettered(shape, sign.letter(), &colour)
        }
        Sign::Agent(agent) => {
            let colour = colour(agent);
            let shape = format!(r#"<circle cx="{centre_x}" cy="{centre_y}" r="9" fill="{colour}"/>"#);
            lettered(shape, sign.letter(), "#fff")
        }
        Sign::Finished(agent) => {
            let colour = colour(agent);
            let ring = format!(
                r#"<circle class="finished" cx="{centre_x}" cy="{centre_y}" r="10" stroke="{colour}"/>"#
            );
            lettered(ring, agent_letter(agent as usize), &colour)
        }
        Sign::Free | Sign::Occupied | Sign::OccupiedObstacle | Sign::Set => String::new(),
    }
}

/// Returns the colour of an agent and its goal; agents with consecutive letters get very different hues.
fn colour(agent: u32) -> String {
    const GOLDEN_ANGLE: usize = 137;
    let hue = agent_letter(agent as usize) as usize * GOLDEN_ANGLE % 360;
    format!("hsl({hue} 65% 33%)")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_with_digits_are_drawn_as_squares() {
        let grid = Grid::of_rows(vec![vec![Sign::Agent(26), Sign::Goal(26), Sign::Goal(99)]]);
        let svg = drawing("got", &grid, &Grid::default()).unwrap_or_default();
        let shapes = ["<circle", "class=\"goal\"", ">0</text>", ">?</text>", "differs"];
        assert_eq!(shapes.map(|shape| svg.matches(shape).count()), [1, 2, 2, 1, 0]);
    }

    #[test]
    fn finished_agents_and_hidden_signs_are_drawn() {
        let rows = vec![vec![Sign::Agent(0), Sign::Finished(1)]];
        let covered = vec![Covered { row: 0, column: 0, under: vec![Sign::Goal(2), Sign::Obstacle] }];
        let svg = drawing("before", &Grid { rows, covered }, &Grid::default()).unwrap_or_default();
        let shapes =
            [r#"class="obstacle""#, r#"class="goal""#, r#"class="finished""#, ">b</text>", ">C</text>"];
        assert_eq!(shapes.map(|shape| svg.matches(shape).count()), [1, 1, 1, 1, 0]);
        assert!(svg.find("obstacle") < svg.find("goal") && svg.find("goal") < svg.find("<circle"));
    }
}
