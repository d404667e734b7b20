//! Maps as text, with all characters that have a meaning in POGEMA.

use std::collections::BTreeMap;

use pogema_core::{Cell, Error, Map, counted, uneven_row};

use crate::config::Targets;
use crate::formats::check_equal_numbers;
use crate::source::check_on_map;

/// The content of a map text, or a map of a config, which may hold more than a map text can express.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MapText {
    /// The obstacles.
    pub map: Map,
    /// The cells of `a` to `z`, in alphabetical order.
    pub starts: Vec<Cell>,
    /// The cells of `A` to `Z`, in alphabetical order: the first one is the goal of the first start. Configs may have
    /// goal sequences.
    pub goals: Targets,
    /// The cells from which starts and goals are drawn, if the text has one of `@`, `$` and `!`.
    pub pools: Option<(Vec<Cell>, Vec<Cell>)>,
}

/// Number of agents for which a map text has letters.
const MAX_LETTERS: usize = 26;

impl From<Map> for MapText {
    fn from(map: Map) -> Self {
        Self { map, starts: Vec::new(), goals: Targets::default(), pools: None }
    }
}

impl MapText {
    /// Returns the rows of the map text.
    ///
    /// # Errors [`Error::Instance`] or [`Error::Config`] for content that a map text cannot express: more than 26
    /// agents, unequal numbers of starts and goals, goal sequences, two letters on one cell, a letter on an obstacle,
    /// or both letters and pools. These errors also occur if a cell of a pool is not free, if a pool is not in
    /// row-by-row order, or if both pools hold all free cells. [`Error::CellOutside`] for a cell off the map.
    ///
    /// Rule: grid/text, grid/letters, grid/pools
    pub fn rows(&self) -> Result<Vec<String>, Error> {
        check_equal_numbers(&self.starts, &self.goals)?;
        self.draw([true, true])
    }

    /// Returns the rows with the starts and the rows with the goals, for drawings in which a start and a goal may share
    /// a cell.
    ///
    /// # Errors
    /// As for [`MapText::rows`].
    pub fn rows_apart(&self) -> Result<[Vec<String>; 2], Error> {
        check_equal_numbers(&self.starts, &self.goals)?;
        Ok([self.draw([true, false])?, self.draw([false, true])?])
    }

    /// Returns the rows with the starts, the goals, or both.
    fn draw(&self, [has_starts, has_goals]: [bool; 2]) -> Result<Vec<String>, Error> {
        let Targets::Single(goals) = &self.goals else {
            return Err(Error::config("targets_xy", "goal sequences", "one goal per agent in a map text"));
        };
        check_on_map(self.map.sides(), "agents_xy", &self.starts)?;
        check_on_map(self.map.sides(), "targets_xy", goals)?;
        let mut letters: Vec<char> = self.map.rows().concat().chars().collect();
        if let Some((starts, goals)) = &self.pools {
            self.check_pools(starts, goals)?;
            let mut kinds = vec![0; letters.len()];
            for (cells, kind) in [(starts, 1), (goals, 2)] {
                for &cell in cells {
                    kinds[self.map.index(cell)] |= kind;
                }
            }
            for (letter, kind) in letters.iter_mut().zip(kinds).filter(|(letter, _)| **letter == '.') {
                *letter = ['!', '@', '$', '.'][kind];
            }
        }
        if self.starts.len() > MAX_LETTERS {
            let reason = format!(
                "a map text has letters for {MAX_LETTERS} agents, but the map has {}",
                self.starts.len()
            );
            return Err(Error::instance(reason));
        }
        for (first, cells, is_drawn) in [(b'a', &self.starts, has_starts), (b'A', goals, has_goals)] {
            for (letter, &cell) in (first..).zip(cells).filter(|_| is_drawn) {
                let place = &mut letters[self.map.index(cell)];
                if *place != '.' {
                    let reason = format!(
                        "a map text has one character per cell, and cell {cell} is `{place}` already"
                    );
                    return Err(Error::instance(reason));
                }
                *place = letter as char;
            }
        }
        Ok(letters.chunks(self.map.width()).map(|row| row.iter().collect()).collect())
    }

    /// Checks that a reader of the map text finds the same pools. Their order decides which cells a seed chooses.
    fn check_pools(&self, starts: &[Cell], goals: &[Cell]) -> Result<(), Error> {
        if !self.starts.is_empty() {
            let expected = "none beside starts and goals in a map text";
            return Err(Error::config("possible_agents_xy", counted(starts.len(), "cell"), expected));
        }
        for (field, cells) in [("possible_agents_xy", starts), ("possible_targets_xy", goals)] {
            check_on_map(self.map.sides(), field, cells)?;
            if let Some(cell) = cells.iter().find(|&&cell| self.map.is_obstacle(cell)) {
                let found = format!("{cell}, an obstacle");
                return Err(Error::config(field, found, "free cells in a map text"));
            }
            let mut pairs = cells.iter().zip(cells.iter().skip(1));
            if let Some((before, after)) = pairs.find(|(before, after)| before >= after) {
                let found = format!("{after} after {before}");
                let expected = "each cell once and row by row in a map text";
                return Err(Error::config(field, found, expected));
            }
        }
        if starts.len().min(goals.len()) == self.map.num_free() {
            let expected = "fewer cells in a map text, or no list";
            return Err(Error::config("possible_agents_xy", "all free cells", expected));
        }
        Ok(())
    }

    /// Returns the map text.
    ///
    /// # Errors
    /// Those of [`MapText::rows`].
    pub fn to_text(&self) -> Result<String, Error> {
        self.rows().map(|rows| rows.join("\n"))
    }
}

/// Reads a side of a map from a file's header. `wrong` makes the error from what was expected.
pub(crate) fn parse_side(text: &str, wrong: impl FnOnce(&str) -> Error) -> Result<usize, Error> {
    let side = text.parse::<usize>().ok().filter(|side| (1..=Map::LONGEST_SIDE).contains(side));
    side.ok_or_else(|| wrong(&format!("a whole number from 1 to {}", Map::LONGEST_SIDE)))
}

/// Returns the column at which a part of a line begins, counted from 1.
pub(crate) fn column_of(line: &str, part: &str) -> usize {
    // Both are slices of one line, so the distance of their pointers is the offset of the part.
    let begin = part.as_ptr() as usize - line.as_ptr() as usize;
    line[..begin].chars().count() + 1
}

/// Reads a map text.
///
/// `.` is free, `#` an obstacle, `a` to `z` are starts, `A` to `Z` goals, `@` is a possible start, `$` a possible goal,
/// and `!` is free but neither a possible start nor a possible goal. White space separates rows.
///
/// # Errors
/// With line and column: [`Error::UnknownCharacter`] for an unknown character, [`Error::Map`] for a row of another
/// length, a side over [`Map::LONGEST_SIDE`], or no cell at all. [`Error::Instance`] for unequal numbers of starts and
/// goals, or for letters together with `@`, `$` or `!`.
///
/// Rule: grid/text, grid/letters, grid/pools
///
/// Source: POGEMA 1.4.0, `grid_config.py`, `GridConfig.str_map_to_list`
pub fn parse_map_text(text: &str) -> Result<MapText, Error> {
    let mut reader = Reader::default();
    for (line, words) in text.lines().enumerate() {
        for word in words.split_whitespace() {
            reader.read_row(word).map_err(|(col, fault)| {
                let (line, column) = (line + 1, column_of(words, word) + col);
                match fault {
                    Fault::Character(character) => Error::UnknownCharacter { line, column, character },
                    Fault::Other(reason) => Error::Map { line, column, reason },
                }
            })?;
        }
    }
    reader.finish()
}

#[derive(Default)]
struct Reader {
    height: usize,
    width: usize,
    obstacles: Vec<bool>,
    starts: BTreeMap<char, Cell>,
    goals: BTreeMap<char, Cell>,
    possible_starts: Vec<Cell>,
    possible_goals: Vec<Cell>,
    has_pools: bool,
}

/// A reason why a row cannot be read.
enum Fault {
    Character(char),
    Other(String),
}

impl Reader {
    /// Reads a row; an error holds the column, counted from 0.
    fn read_row(&mut self, row: &str) -> Result<(), (usize, Fault)> {
        let coordinate = |number: usize, col: usize| {
            let reason = || format!("the map has more than {} rows or columns", Map::LONGEST_SIDE);
            let fits = number < Map::LONGEST_SIDE;
            fits.then_some(number as u16).ok_or_else(|| (col, Fault::Other(reason())))
        };
        for (col, character) in row.chars().enumerate() {
            let cell = Cell::new(coordinate(self.height, col)?, coordinate(col, col)?);
            if !self.read_cell(character, cell) {
                return Err((col, Fault::Character(character)));
            }
        }
        let length = row.chars().count();
        if self.height == 0 {
            self.width = length;
        } else if length != self.width {
            let reason = uneven_row(length, self.width);
            return Err((length.min(self.width), Fault::Other(reason)));
        }
        self.height += 1;
        Ok(())
    }

    fn read_cell(&mut self, character: char, cell: Cell) -> bool {
        let (may_start, may_end) = match character {
            '.' => (true, true),
            '#' | '!' => (false, false),
            '@' => (true, false),
            '$' => (false, true),
            'a'..='z' => {
                self.starts.insert(character, cell);
                (true, true)
            }
            'A'..='Z' => {
                self.goals.insert(character, cell);
                (true, true)
            }
            _ => return false,
        };
        self.has_pools |= matches!(character, '@' | '$' | '!');
        self.obstacles.push(character == '#');
        if may_start {
            self.possible_starts.push(cell);
        }
        if may_end {
            self.possible_goals.push(cell);
        }
        true
    }

    fn finish(self) -> Result<MapText, Error> {
        if self.height == 0 {
            let reason = "the map has no cell, expected some of `.#@$!`, a-z and A-Z".into();
            return Err(Error::Map { line: 1, column: 1, reason });
        }
        let (num_starts, num_goals) = (self.starts.len(), self.goals.len());
        if num_starts != num_goals {
            let reason = format!(
                "the map has {} (a-z) and {} (A-Z), expected equal numbers",
                counted(num_starts, "start"),
                counted(num_goals, "goal")
            );
            return Err(Error::instance(reason));
        }
        if num_starts > 0 && self.has_pools {
            let reason =
                "the map has letters and one of `@$!`, expected either exact or possible starts and goals";
            return Err(Error::instance(reason));
        }
        let map = Map::new(self.height, self.width, self.obstacles)?;
        let pools = self.has_pools.then_some((self.possible_starts, self.possible_goals));
        let starts = self.starts.into_values().collect();
        let goals = Targets::Single(self.goals.into_values().collect());
        Ok(MapText { map, starts, goals, pools })
    }
}
