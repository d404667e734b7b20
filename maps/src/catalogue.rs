//! Built-in maps, by name.

mod puzzles;

use pogema_core::{Cell, Error, Map};

use crate::config::{Targets, did_you_mean};
use crate::formats::NamedMap;
use crate::text::MapText;

pub use puzzles::PUZZLES;

/// A small map with starts and goals, on which agents cannot ignore each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Puzzle {
    /// The name, with the prefix `puzzle-`.
    pub name: &'static str,
    /// The task of the agents, in one sentence.
    pub task: &'static str,
    /// The rows of the map with the start of each agent: `a` for agent 0, and so on.
    pub starts: [&'static str; 5],
    /// The rows of the map with the goal of each agent: `a` for agent 0, and so on.
    pub goals: [&'static str; 5],
    /// The optimal sum of costs with `on_target: nothing`, found by a search through all joint states.
    pub sum_of_costs: u64,
}

impl Puzzle {
    /// Returns the map with starts and goals.
    ///
    /// # Errors
    /// None for the puzzles of the catalogue.
    pub fn text(&self) -> Result<MapText, Error> {
        let plain = self.starts.map(|row| row.replace(|letter: char| letter != '#', "."));
        Ok(MapText {
            map: Map::from_rows(&plain)?,
            starts: cells_of_letters(&self.starts),
            goals: Targets::Single(cells_of_letters(&self.goals)),
            pools: None,
        })
    }
}

/// Returns the cells of the lowercase letters, in alphabetical order.
fn cells_of_letters(rows: &[&str; 5]) -> Vec<Cell> {
    let letters = (0..).zip(rows).flat_map(|(row, text)| {
        (0..).zip(text.chars()).map(move |(col, letter)| (letter, Cell::new(row, col)))
    });
    let mut letters: Vec<(char, Cell)> = letters.filter(|(letter, _)| letter.is_ascii_lowercase()).collect();
    letters.sort_unstable();
    letters.into_iter().map(|(_, cell)| cell).collect()
}

/// The maps without agents, each with its name.
const MAPS: [(&str, &str); 1] = [("four-rooms", include_str!("../data/four-rooms.txt"))];

/// Returns the names of all built-in maps.
pub fn map_names() -> impl Iterator<Item = &'static str> {
    MAPS.iter().map(|(name, _)| *name).chain(PUZZLES.iter().map(|puzzle| puzzle.name))
}

/// Returns the map with a name, with starts and goals if it is a puzzle.
///
/// # Errors
/// [`Error::Config`] with the nearest known name if the name is unknown.
///
/// Rule: grid/named
pub fn named_map(name: &str) -> Result<MapText, Error> {
    if let Some(puzzle) = PUZZLES.iter().find(|puzzle| puzzle.name == name) {
        return puzzle.text();
    }
    let Some((_, text)) = MAPS.iter().find(|(known, _)| *known == name) else {
        let expected = format!("a known map{}", did_you_mean(name, map_names()));
        return Err(Error::config("map_name", name, expected));
    };
    Map::from_rows(&text.split_whitespace().collect::<Vec<_>>()).map(MapText::from)
}

/// Returns all built-in maps with their names.
pub(crate) fn named_maps() -> impl Iterator<Item = NamedMap> {
    let named = |name: &'static str| Some(NamedMap { name: name.into(), text: named_map(name).ok()? });
    map_names().filter_map(named)
}
