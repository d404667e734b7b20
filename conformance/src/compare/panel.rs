//! Pictures of a difference, and their text cut down to where something differs.

use std::fmt::Write as _;
use std::ops::Range;

use pogema_core::picture::{Mark, agent_letter};
use serde::Serializer;

/// Rows of signs, each row of one length.
pub type Grid = Vec<Vec<Sign>>;

/// What a picture shows at one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// Nothing.
    Free,
    /// An obstacle.
    Obstacle,
    /// An active agent, by index.
    Agent(u32),
    /// The goal of an active agent, by index.
    Goal(u32),
    /// A mark of the occupancy grid.
    Occupied,
    /// A value of a window that is not 0.
    Set,
}

impl Sign {
    /// The letter in texts, as in [`pogema_core::picture`].
    pub fn letter(self) -> char {
        match self {
            Self::Free => '.',
            Self::Obstacle => '#',
            Self::Agent(agent) => agent_letter(agent as usize),
            Self::Goal(agent) => agent_letter(agent as usize).to_ascii_uppercase(),
            Self::Occupied => 'o',
            Self::Set => '1',
        }
    }
}

impl From<Mark> for Sign {
    fn from(mark: Mark) -> Self {
        match mark {
            Mark::Free => Self::Free,
            Mark::Obstacle => Self::Obstacle,
            Mark::Agent(agent) => Self::Agent(agent as u32),
            Mark::Goal(agent) => Self::Goal(agent as u32),
        }
    }
}

/// Which state or answer a panel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// The state before the operation.
    Before,
    /// The expected answer.
    Expected,
    /// The answer that came.
    Got,
}

/// What the pictures of a panel show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Agents with their goals, then occupancy. There are no pictures if something is off the map.
    State,
    /// The channels of one agent's window.
    Window,
}

/// Pictures of one size that stand side by side.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Panel {
    /// Which state or answer it shows.
    pub moment: Moment,
    /// What its pictures show.
    pub content: Content,
    /// The pictures.
    pub grids: Vec<Grid>,
}

impl Panel {
    /// A line that says what is shown.
    pub fn title(&self) -> String {
        let moment = match self.moment {
            Moment::Before => "before",
            Moment::Expected => "expected",
            Moment::Got => "got",
        };
        let shown = match (self.content, self.grids.len()) {
            (Content::State, 0) => ": somebody or something is off the map",
            (Content::State, _) => ": agents and goals, then occupancy",
            (Content::Window, 3) => ": obstacles, agents, goal",
            (Content::Window, _) => "",
        };
        format!("{moment}{shown}")
    }

    /// Rows and columns of each picture.
    fn size(&self) -> (usize, usize) {
        let first = self.grids.first();
        (first.map_or(0, Vec::len), first.and_then(|grid| grid.first()).map_or(0, Vec::len))
    }

    /// The first place where two panels of one size differ.
    fn differs_at(&self, other: &Self) -> Option<(usize, usize)> {
        let differing = |(one, other): (&Grid, &Grid)| {
            let mut rows = one.iter().zip(other).enumerate();
            rows.find_map(|(row, (one, other))| {
                Some((row, one.iter().zip(other).position(|(one, other)| one != other)?))
            })
        };
        self.grids.iter().zip(&other.grids).filter_map(differing).min()
    }
}

/// How much of each panel a text shows.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Rows of each picture.
    pub rows: usize,
    /// Columns of all pictures that are side by side.
    pub columns: usize,
}

impl Limits {
    /// Shows everything.
    pub const NONE: Self = Self { rows: usize::MAX, columns: usize::MAX };
}

/// The panels as text. Large pictures are cut down to the neighbourhood of the first difference.
pub fn text_of_panels(panels: &[Panel], limits: Limits) -> String {
    let mut text = String::new();
    for panel in panels {
        let (height, width) = panel.size();
        let alike = |other: &&Panel| (other.size(), other.grids.len()) == (panel.size(), panel.grids.len());
        let (row, column) = place_of_difference(&panels.iter().filter(alike).collect::<Vec<_>>());
        let rows = around(row, limits.rows, height);
        let columns = around(column, limits.columns / panel.grids.len().max(1), width);
        let _ = write!(text, "  {}", panel.title());
        if (rows.len(), columns.len()) != (height, width) {
            let [rows, columns] = [&rows, &columns].map(|cut| format!("{} to {}", cut.start, cut.end - 1));
            let _ = write!(text, " (rows {rows} of {height}, columns {columns} of {width})");
        }
        text.push('\n');
        for row in rows {
            let part = |grid: &Grid| grid[row][columns.clone()].iter().map(|sign| sign.letter()).collect();
            let parts: Vec<String> = panel.grids.iter().map(part).collect();
            let _ = writeln!(text, "    {}", parts.join("   "));
        }
    }
    text
}

/// Writes panels into a report as their whole text.
pub fn serialize<S: Serializer>(panels: &[Panel], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&text_of_panels(panels, Limits::NONE))
}

/// The place to show: where an answer is not as expected, or else where the state changed.
fn place_of_difference(alike: &[&Panel]) -> (usize, usize) {
    let mut pairs = alike.windows(2).rev();
    pairs.find_map(|pair| pair[0].differs_at(pair[1])).unwrap_or((0, 0))
}

/// At most `most` places of a line of `size`, with `place` in their middle if possible.
fn around(place: usize, most: usize, size: usize) -> Range<usize> {
    let begin = place.saturating_sub(most / 2).min(size.saturating_sub(most));
    begin..(begin + most).min(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two states of a map, alike but for one cell.
    fn two_states(height: usize, width: usize, (row, column): (usize, usize)) -> Vec<Panel> {
        let free = vec![vec![Sign::Free; width]; height];
        let mut agents = free.clone();
        agents[row][column] = Sign::Agent(0);
        let panel =
            |moment, agents| Panel { moment, content: Content::State, grids: vec![agents, free.clone()] };
        vec![panel(Moment::Expected, agents), panel(Moment::Got, free.clone())]
    }

    #[test]
    fn what_fits_stays_as_it_is() {
        let mut panels = two_states(12, 60, (11, 59));
        panels.push(Panel { moment: Moment::Got, content: Content::State, grids: Vec::new() });
        let text = text_of_panels(&panels, Limits { rows: 12, columns: 120 });
        assert_eq!(text, text_of_panels(&panels, Limits::NONE));
        assert_eq!(text.lines().count(), 27);
        assert!(text.ends_with("\n  got: somebody or something is off the map\n"), "{text}");
    }

    #[test]
    fn what_is_cut_shows_the_difference() {
        let panels = two_states(200, 300, (150, 299));
        let shown = text_of_panels(&panels, Limits { rows: 4, columns: 20 });
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
