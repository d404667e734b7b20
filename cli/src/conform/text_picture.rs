//! The text pictures of a difference: read again, and cut down to where something differs.

use std::fmt::Write as _;
use std::ops::Range;

/// A line that says what is shown, and pictures side by side, row by row.
pub struct Panel<'a> {
    /// What is shown.
    pub title: &'a str,
    /// Of each row its part of each picture.
    pub rows: Vec<Vec<&'a str>>,
}

impl Panel<'_> {
    /// Rows, and columns of each picture.
    fn size(&self) -> (usize, Vec<usize>) {
        let widths = self.rows.first().map(|row| row.iter().map(|part| part.len()).collect());
        (self.rows.len(), widths.unwrap_or_default())
    }

    /// The first place where two panels of one size differ.
    fn differs_at(&self, other: &Self) -> Option<(usize, usize)> {
        let mut rows = self.rows.iter().zip(&other.rows).enumerate();
        rows.find_map(|(row, (one, other))| Some((row, one.iter().zip(other).filter_map(differing).min()?)))
    }
}

fn differing((one, other): (&&str, &&str)) -> Option<usize> {
    one.bytes().zip(other.bytes()).position(|(one, other)| one != other)
}

/// The panels of a text.
pub fn panels(text: &str) -> Vec<Panel<'_>> {
    let mut panels: Vec<Panel<'_>> = Vec::new();
    for line in text.lines() {
        match (line.strip_prefix("    "), panels.last_mut()) {
            (Some(row), Some(panel)) => panel.rows.push(row.split_whitespace().collect()),
            _ => panels.push(Panel { title: line.trim(), rows: Vec::new() }),
        }
    }
    panels
}

/// How much of a picture is shown.
#[derive(Clone, Copy)]
pub struct Limits {
    /// Rows of each picture.
    pub rows: usize,
    /// Columns of all pictures that are side by side.
    pub columns: usize,
}

/// A text whose large pictures are cut down to the neighbourhood of the first difference.
pub fn cut(text: &str, limits: Limits) -> String {
    let panels = panels(text);
    let mut shown = String::new();
    for panel in &panels {
        let (height, widths) = panel.size();
        let width = widths.iter().copied().max().unwrap_or(0);
        let alike: Vec<&Panel<'_>> = panels.iter().filter(|other| other.size() == panel.size()).collect();
        let (row, column) = place_of_difference(&alike);
        let rows = around(row, limits.rows, height);
        let columns = around(column, limits.columns / widths.len().max(1), width);
        let _ = write!(shown, "  {}", panel.title);
        if (rows.len(), columns.len()) != (height, width) {
            let [rows, columns] = [&rows, &columns].map(|cut| format!("{} to {}", cut.start, cut.end - 1));
            let _ = write!(shown, " (rows {rows} of {height}, columns {columns} of {width})");
        }
        shown.push('\n');
        for row in &panel.rows[rows] {
            let parts: Vec<&str> = row.iter().map(|part| part.get(columns.clone()).unwrap_or(part)).collect();
            let _ = writeln!(shown, "    {}", parts.join("   "));
        }
    }
    shown
}

/// Where to look: at what is not as expected, otherwise at what changed.
fn place_of_difference(alike: &[&Panel<'_>]) -> (usize, usize) {
    let places = alike.windows(2).rev().filter_map(|pair| pair[0].differs_at(pair[1]));
    places.into_iter().next().unwrap_or((0, 0))
}

/// As many of a line of cells as are wanted, with a place in their middle if possible.
fn around(place: usize, most: usize, size: usize) -> Range<usize> {
    let begin = place.saturating_sub(most / 2).min(size.saturating_sub(most));
    begin..(begin + most).min(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two states of a map, alike but for one cell.
    fn two_states(height: usize, width: usize, place: (usize, usize)) -> String {
        let state = |what: &str, letter: char| {
            let cell = |row, column| if (row, column) == place { letter } else { '.' };
            let line = |row| (0..width).map(|column| cell(row, column)).collect::<String>();
            let lines = (0..height).map(|row| format!("    {}   {}\n", line(row), ".".repeat(width)));
            format!("  {what}: agents and goals, then occupancy\n{}", lines.collect::<String>())
        };
        state("expected", 'a') + &state("got", '.')
    }

    #[test]
    fn what_fits_stays_as_it_is() {
        let text = two_states(12, 60, (11, 59)) + "  got: somebody or something is off the map\n";
        assert_eq!(cut(&text, Limits { rows: 12, columns: 120 }), text);
    }

    #[test]
    fn what_is_cut_shows_the_difference() {
        let shown = cut(&two_states(200, 300, (150, 299)), Limits { rows: 4, columns: 20 });
        let title = "agents and goals, then occupancy (rows 148 to 151 of 200, columns 290 to 299 of 300)";
        let empty = "    ..........   ..........";
        let agent = "    .........a   ..........";
        let expected = [
            &format!("  expected: {title}"),
            empty,
            empty,
            agent,
            empty,
            &format!("  got: {title}"),
            empty,
            empty,
            empty,
            empty,
        ];
        assert_eq!(shown.lines().collect::<Vec<_>>(), expected);
    }
}
