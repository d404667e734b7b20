//! Pictures of a difference, and their text form, cropped around the first difference.

use std::fmt::Write as _;
use std::ops::Range;

use pogema_core::picture::agent_letter;
use serde::Serializer;

/// One picture: rows of signs, and what these signs hide.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Grid {
    /// The topmost sign of each place. All rows have the same length.
    pub rows: Vec<Vec<Sign>>,
    /// The places where a sign hides others, row by row.
    pub covered: Vec<Covered>,
}

impl Grid {
    /// Creates a grid whose signs hide nothing.
    pub fn of_rows(rows: Vec<Vec<Sign>>) -> Self {
        Self { rows, covered: Vec::new() }
    }
}

/// A place whose sign hides others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Covered {
    /// The row of the place.
    pub row: usize,
    /// The column of the place.
    pub column: usize,
    /// The hidden signs, from top to bottom.
    pub under: Vec<Sign>,
}

/// The content of one place of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// A free place.
    Free,
    /// An obstacle.
    Obstacle,
    /// An active agent, by index.
    Agent(u32),
    /// The goal of an active agent, by index.
    Goal(u32),
    /// A finished agent, by index.
    Finished(u32),
    /// A mark of the occupancy grid.
    Occupied,
    /// A mark of the occupancy grid on an obstacle.
    OccupiedObstacle,
    /// A nonzero value of a window.
    Set,
}

impl Sign {
    /// Returns the character of the sign in texts, as in [`pogema_core::picture`].
    pub fn letter(self) -> char {
        match self {
            Self::Free => '.',
            Self::Obstacle => '#',
            Self::Agent(agent) => agent_letter(agent as usize),
            Self::Goal(agent) => agent_letter(agent as usize).to_ascii_uppercase(),
            Self::Finished(_) => '*',
            Self::Occupied => 'o',
            Self::OccupiedObstacle => '%',
            Self::Set => '1',
        }
    }

    /// Returns the meaning of the character, for the legend; none for signs that need no explanation.
    fn meaning(self) -> Option<&'static str> {
        match self {
            Self::Free | Self::Set => None,
            Self::Agent(_) => Some("a, b… agents"),
            Self::Goal(_) => Some("A, B… their goals"),
            Self::Finished(_) => Some("* a finished agent"),
            Self::Obstacle => Some("# an obstacle"),
            Self::Occupied => Some("o a marked cell"),
            Self::OccupiedObstacle => Some("% a marked obstacle"),
        }
    }
}

impl std::fmt::Display for Sign {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::Free | Self::Set => write!(f, "{}", self.letter()),
            Self::Obstacle => f.write_str("an obstacle"),
            Self::Agent(agent) => write!(f, "agent {}", agent_letter(agent as usize)),
            Self::Goal(agent) => write!(f, "the goal of {}", agent_letter(agent as usize)),
            Self::Finished(agent) => write!(f, "finished agent {}", agent_letter(agent as usize)),
            Self::Occupied | Self::OccupiedObstacle => f.write_str("a mark"),
        }
    }
}

/// The state or answer that a panel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// The state before the operation.
    Before,
    /// The expected answer.
    Expected,
    /// The received answer.
    Got,
}

/// The kind of pictures in a panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Agents with their goals, then occupancy. If an agent, goal or mark is off the map, the panel has no pictures.
    State,
    /// The channels of one agent's window.
    Window,
}

/// Pictures of one size, shown side by side.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Panel {
    /// The state or answer that it shows.
    pub moment: Moment,
    /// The kind of its pictures.
    pub content: Content,
    /// The pictures.
    pub grids: Vec<Grid>,
}

impl Panel {
    /// Returns a one-line title.
    pub fn title(&self) -> String {
        let moment = match self.moment {
            Moment::Before => "before",
            Moment::Expected => "expected",
            Moment::Got => "got",
        };
        let shown = match (self.content, self.grids.len()) {
            (Content::State, 0) => ": an agent, goal or mark is off the map",
            (Content::State, _) => ": agents and goals, then occupancy",
            (Content::Window, 3) => ": obstacles, agents, goal",
            (Content::Window, _) => "",
        };
        format!("{moment}{shown}")
    }

    /// Returns the numbers of rows and columns of each picture.
    fn size(&self) -> (usize, usize) {
        let first = self.grids.first();
        let rows = first.map_or(&[][..], |grid| &grid.rows);
        (rows.len(), rows.first().map_or(0, Vec::len))
    }

    /// Returns the first place where two panels of one size differ.
    fn differs_at(&self, other: &Self) -> Option<(usize, usize)> {
        let differing = |(one, other): (&Grid, &Grid)| {
            let mut rows = one.rows.iter().zip(&other.rows).enumerate();
            rows.find_map(|(row, (one, other))| {
                Some((row, one.iter().zip(other).position(|(one, other)| one != other)?))
            })
        };
        self.grids.iter().zip(&other.grids).filter_map(differing).min()
    }
}

/// Maximum size of the pictures in a text.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Maximum number of rows of each picture.
    pub rows: usize,
    /// Maximum total number of columns of the pictures side by side.
    pub columns: usize,
}

impl Limits {
    /// No limits.
    pub const NONE: Self = Self { rows: usize::MAX, columns: usize::MAX };
}

/// Maximum number of notes below a panel.
const MAX_NOTES: usize = 6;

/// Formats panels as text, with a legend. Crops large pictures to the neighbourhood of the first difference.
pub fn text_of_panels(panels: &[Panel], limits: Limits) -> String {
    let mut text = String::new();
    let mut meanings: Vec<&str> = Vec::new();
    for panel in panels {
        let (height, width) = panel.size();
        let same_size =
            |other: &&Panel| (other.size(), other.grids.len()) == (panel.size(), panel.grids.len());
        let (row, column) = place_to_show(&panels.iter().filter(same_size).collect::<Vec<_>>());
        let rows = around(row, limits.rows, height);
        let columns = around(column, limits.columns / panel.grids.len().max(1), width);
        let _ = write!(text, "  {}", panel.title());
        if (rows.len(), columns.len()) != (height, width) {
            let [rows, columns] = [&rows, &columns].map(|cut| format!("{} to {}", cut.start, cut.end - 1));
            let _ = write!(text, " (rows {rows} of {height}, columns {columns} of {width})");
        }
        text.push('\n');
        for row in rows.clone() {
            let part =
                |grid: &Grid| grid.rows[row][columns.clone()].iter().map(|sign| sign.letter()).collect();
            let parts: Vec<String> = panel.grids.iter().map(part).collect();
            let _ = writeln!(text, "    {}", parts.join("   "));
        }
        let is_shown = |row: usize, column: usize| rows.contains(&row) && columns.contains(&column);
        add_notes(&mut text, panel, is_shown);
        let shown = panel.grids.iter().flat_map(|grid| &grid.rows[rows.clone()]);
        for meaning in shown.flat_map(|row| &row[columns.clone()]).filter_map(|sign| sign.meaning()) {
            if !meanings.contains(&meaning) {
                meanings.push(meaning);
            }
        }
    }
    if !meanings.is_empty() {
        meanings.sort_unstable_by_key(|meaning| "aA*#o%".find(&meaning[..1]));
        let _ = writeln!(text, "  ({})", meanings.join("; "));
    }
    text
}

/// Lists what the letters of a panel do not show: which agents have finished, and what is hidden.
fn add_notes(text: &mut String, panel: &Panel, is_shown: impl Fn(usize, usize) -> bool) {
    let mut notes = Vec::new();
    for grid in &panel.grids {
        for (row, signs) in grid.rows.iter().enumerate() {
            for (column, sign) in signs.iter().enumerate() {
                if let Sign::Finished(_) = sign
                    && is_shown(row, column)
                {
                    notes.push(format!("{} at [{row},{column}]: {sign}", sign.letter()));
                }
            }
        }
        for Covered { row, column, under } in &grid.covered {
            if is_shown(*row, *column) {
                let under = under.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
                let letter = grid.rows[*row][*column].letter();
                notes.push(format!("{letter} at [{row},{column}] hides {under}"));
            }
        }
    }
    for note in notes.iter().take(MAX_NOTES) {
        let _ = writeln!(text, "    {note}");
    }
    if notes.len() > MAX_NOTES {
        let _ = writeln!(text, "    and {} more", notes.len() - MAX_NOTES);
    }
}

/// Serializes panels as their text without limits.
pub fn serialize<S: Serializer>(panels: &[Panel], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&text_of_panels(panels, Limits::NONE))
}

/// Returns the place to show: where the answers differ, otherwise where the state changed.
fn place_to_show(same_size: &[&Panel]) -> (usize, usize) {
    let mut pairs = same_size.windows(2).rev();
    pairs.find_map(|pair| pair[0].differs_at(pair[1])).unwrap_or((0, 0))
}

/// Returns a range of at most `max_length` indices below `size`, centred on `place` if possible.
fn around(place: usize, max_length: usize, size: usize) -> Range<usize> {
    let begin = place.saturating_sub(max_length / 2).min(size.saturating_sub(max_length));
    begin..(begin + max_length).min(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns two states of a map that differ in one cell.
    fn two_states(height: usize, width: usize, (row, column): (usize, usize)) -> Vec<Panel> {
        let free = Grid::of_rows(vec![vec![Sign::Free; width]; height]);
        let mut agents = free.clone();
        agents.rows[row][column] = Sign::Agent(0);
        let panel =
            |moment, agents| Panel { moment, content: Content::State, grids: vec![agents, free.clone()] };
        vec![panel(Moment::Expected, agents), panel(Moment::Got, free.clone())]
    }

    #[test]
    fn small_pictures_are_not_cropped() {
        let mut panels = two_states(12, 60, (11, 59));
        panels.push(Panel { moment: Moment::Got, content: Content::State, grids: Vec::new() });
        let text = text_of_panels(&panels, Limits { rows: 12, columns: 120 });
        assert_eq!(text, text_of_panels(&panels, Limits::NONE));
        assert_eq!(text.lines().count(), 28);
        let end = "\n  got: an agent, goal or mark is off the map\n  (a, b… agents)\n";
        assert!(text.ends_with(end), "{text}");
    }

    #[test]
    fn cropped_pictures_show_the_difference() {
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
            "  (a, b… agents)",
        ];
        assert_eq!(shown.lines().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn notes_name_finished_agents_and_hidden_signs() {
        let rows = vec![vec![Sign::Agent(0), Sign::Finished(1), Sign::Goal(0)]];
        let under = vec![Sign::Goal(2), Sign::Obstacle];
        let agents = Grid { rows, covered: vec![Covered { row: 0, column: 0, under }] };
        let marks = Grid::of_rows(vec![vec![Sign::OccupiedObstacle, Sign::Free, Sign::Free]]);
        let panel = Panel { moment: Moment::Before, content: Content::State, grids: vec![agents, marks] };
        let expected = [
            "  before: agents and goals, then occupancy",
            "    a*A   %..",
            "    * at [0,1]: finished agent b",
            "    a at [0,0] hides the goal of c, an obstacle",
            "  (a, b… agents; A, B… their goals; * a finished agent; % a marked obstacle)",
        ];
        let shown = text_of_panels(&[panel], Limits::NONE);
        assert_eq!(shown.lines().collect::<Vec<_>>(), expected);
    }
}
