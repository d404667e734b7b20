//! Maps that come with the program, by name.

mod puzzles;

use pogema_core::{Cell, Error, Map};

use crate::config::nearest;
use crate::formats::NamedMap;
use crate::text::MapText;

pub use puzzles::PUZZLES;

/// A map of five rows and columns on which agents get in each other's way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Puzzle {
    /// Its name.
    pub name: &'static str,
    /// What has to be done.
    pub says: &'static str,
    /// The map, `a` where agent 0 starts, and so on.
    pub starts: [&'static str; 5],
    /// The map, `a` where agent 0 wants to go, and so on.
    pub goals: [&'static str; 5],
    /// The least sum of costs with `on_target: nothing`, as a search through all joint states finds it.
    pub sum_of_costs: u64,
}

impl Puzzle {
    /// The map with starts and goals.
    ///
    /// # Errors
    /// None for the puzzles of the catalogue.
    pub fn text(&self) -> Result<MapText, Error> {
        let plain = self.starts.map(|row| row.replace(|letter: char| letter != '#', "."));
        Ok(MapText {
            map: Map::from_rows(&plain)?,
            starts: cells_of_letters(&self.starts),
            goals: cells_of_letters(&self.goals),
            pools: None,
        })
    }
}

/// Where the letters stand, in the order of the alphabet.
fn cells_of_letters(rows: &[&str; 5]) -> Vec<Cell> {
    let letters = (0..).zip(rows).flat_map(|(row, text)| {
        (0..).zip(text.chars()).map(move |(col, letter)| (letter, Cell::new(row, col)))
    });
    let mut letters: Vec<(char, Cell)> = letters.filter(|(letter, _)| letter.is_ascii_lowercase()).collect();
    letters.sort_unstable();
    letters.into_iter().map(|(_, cell)| cell).collect()
}

/// Each map without agents and its name.
const MAPS: [(&str, &str); 1] = [("four-rooms", include_str!("../data/four-rooms.txt"))];

/// The names of all maps.
pub fn map_names() -> impl Iterator<Item = &'static str> {
    MAPS.iter().map(|(name, _)| *name).chain(PUZZLES.iter().map(|puzzle| puzzle.name))
}

/// The map of a name, with starts and goals if it is a puzzle.
///
/// # Errors
/// [`Error::Config`] with the nearest known name if there is none.
///
/// Rule: grid/named
pub fn named_map(name: &str) -> Result<MapText, Error> {
    if let Some(puzzle) = PUZZLES.iter().find(|puzzle| puzzle.name == name) {
        return puzzle.text();
    }
    let Some((_, text)) = MAPS.iter().find(|(known, _)| *known == name) else {
        let hint = nearest(name, map_names()).unwrap_or_default();
        return Err(Error::config("map_name", name, format!("a known map; the nearest is `{hint}`")));
    };
    Map::from_rows(&text.split_whitespace().collect::<Vec<_>>()).map(MapText::from)
}

/// All maps under their names.
pub(crate) fn named_maps() -> impl Iterator<Item = NamedMap> {
    let named = |name: &'static str| Some(NamedMap { name: name.into(), text: named_map(name).ok()? });
    map_names().filter_map(named)
}
