//! Maps as text, with all the characters POGEMA gives a meaning.

use std::collections::BTreeMap;

use pogema_core::{Cell, Error, Map};

/// What a map text says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MapText {
    /// The obstacles.
    pub map: Map,
    /// Where `a` to `z` stand, in the order of the alphabet.
    pub starts: Vec<Cell>,
    /// Where `A` to `Z` stand, in the order of the alphabet: the first one is the first start's goal.
    pub goals: Vec<Cell>,
    /// Cells that starts and goals may be drawn from, if the text has one of `@`, `$` and `!`.
    pub pools: Option<(Vec<Cell>, Vec<Cell>)>,
}

/// Reads a map text: `.` free, `#` obstacle, `a` a start, `A` a goal, `@` a possible start, `$` a possible
/// goal, `!` neither. White space separates rows.
///
/// # Errors
/// [`Error::Map`] with line and column for an unknown character or a row of another length, and an error for
/// unequal numbers of starts and goals, letters next to `@`, `$` or `!`, or no cell at all.
///
/// Rule: grid/text, grid/letters, grid/pools
///
/// Source: POGEMA 1.4.0, `grid_config.py`, `GridConfig.str_map_to_list`
pub fn parse_map_text(text: &str) -> Result<MapText, Error> {
    let mut reader = Reader::default();
    for (line, words) in text.lines().enumerate() {
        for word in words.split_whitespace() {
            // Both are slices of one line, so the distance between them is where the word begins.
            let begin = word.as_ptr() as usize - words.as_ptr() as usize;
            reader.read_row(word).map_err(|Fault { col, reason }| {
                let column = words[..begin].chars().count() + col + 1;
                Error::Map { line: line + 1, column, reason }
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

/// What is wrong with a row, and at which of its cells.
struct Fault {
    col: usize,
    reason: String,
}

impl Reader {
    fn read_row(&mut self, row: &str) -> Result<(), Fault> {
        let coordinate = |number: usize, col: usize| {
            let reason = |_| format!("the map has more than {} rows or columns", u16::MAX);
            u16::try_from(number).map_err(reason).map_err(|reason| Fault { col, reason })
        };
        for (col, character) in row.chars().enumerate() {
            let cell = Cell::new(coordinate(self.height, col)?, coordinate(col, col)?);
            if !self.read_cell(character, cell) {
                let reason = format!("unknown character `{character}`, expected one of `.#@$!`, a-z or A-Z");
                return Err(Fault { col, reason });
            }
        }
        let length = row.chars().count();
        if self.height == 0 {
            self.width = length;
        } else if length != self.width {
            let reason = format!("the row has {length} cells, expected {} as in the first row", self.width);
            return Err(Fault { col: length.min(self.width), reason });
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
                "the map has {num_starts} starts (a-z) and {num_goals} goals (A-Z), expected as many"
            );
            return Err(Error::instance(reason));
        }
        if num_starts > 0 && self.has_pools {
            let reason =
                "the map has letters and one of `@$!`, expected exact starts and goals or possible ones";
            return Err(Error::instance(reason));
        }
        let map = Map::new(self.height, self.width, self.obstacles)?;
        let pools = self.has_pools.then_some((self.possible_starts, self.possible_goals));
        let starts = self.starts.into_values().collect();
        Ok(MapText { map, starts, goals: self.goals.into_values().collect(), pools })
    }
}
