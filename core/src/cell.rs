//! Cells and actions, the two basic types of the workspace.

use serde::{Deserialize, Serialize};

use crate::Error;

/// A cell of a map, counted from the top left corner of the map without its border.
///
/// Shape: row first, then column, both 0-based.
///
/// Rule: grid/coordinates
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(from = "[u16; 2]", into = "[u16; 2]")]
pub struct Cell {
    /// Row, 0 at the top.
    pub row: u16,
    /// Column, 0 at the left.
    pub col: u16,
}

impl Cell {
    /// Creates a cell from its row and column.
    pub const fn new(row: u16, col: u16) -> Self {
        Self { row, col }
    }

    /// Returns whether the cell lies on a map of `height` rows and `width` columns.
    pub fn is_within(self, height: usize, width: usize) -> bool {
        usize::from(self.row) < height && usize::from(self.col) < width
    }

    /// Returns the Manhattan distance to another cell. It can exceed 16 bits on a large map. Units: cells.
    pub fn distance(self, other: Self) -> u32 {
        u32::from(self.row.abs_diff(other.row)) + u32::from(self.col.abs_diff(other.col))
    }

    /// Returns the cell that `action` leads to, as signed (row, col), since it may lie outside the map.
    ///
    /// Rule: move/actions
    pub fn toward(self, action: Action) -> (i32, i32) {
        let (down, right) = action.delta();
        (i32::from(self.row) + down, i32::from(self.col) + right)
    }

    /// Returns the cell at signed (row, col), such as the result of [`Cell::toward`], if both numbers are in range.
    pub fn checked<N>((row, col): (N, N)) -> Option<Self>
    where
        u16: TryFrom<N>,
    {
        Some(Self::new(u16::try_from(row).ok()?, u16::try_from(col).ok()?))
    }

    /// Returns the action that leads from this cell to another one, if any.
    pub fn action_to(self, other: Self) -> Option<Action> {
        let place = (i32::from(other.row), i32::from(other.col));
        Action::ALL.into_iter().find(|&action| self.toward(action) == place)
    }
}

impl From<[u16; 2]> for Cell {
    fn from([row, col]: [u16; 2]) -> Self {
        Self { row, col }
    }
}

impl From<Cell> for [u16; 2] {
    fn from(cell: Cell) -> Self {
        [cell.row, cell.col]
    }
}

impl std::fmt::Display for Cell {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "({}, {})", self.row, self.col)
    }
}

/// The action of one agent in one step, with POGEMA's numbers.
///
/// Rule: move/actions
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "i64", into = "u8")]
#[repr(u8)]
pub enum Action {
    /// Wait in place.
    #[default]
    Stay = 0,
    /// One row less.
    Up = 1,
    /// One row more.
    Down = 2,
    /// One column less.
    Left = 3,
    /// One column more.
    Right = 4,
}

impl Action {
    /// All actions in the order of their numbers.
    pub const ALL: [Self; 5] = [Self::Stay, Self::Up, Self::Down, Self::Left, Self::Right];

    /// The actions that request a move, in the order of their numbers.
    pub const MOVES: [Self; 4] = [Self::Up, Self::Down, Self::Left, Self::Right];

    /// Returns the change of (row, col) that this action requests.
    pub const fn delta(self) -> (i32, i32) {
        match self {
            Self::Stay => (0, 0),
            Self::Up => (-1, 0),
            Self::Down => (1, 0),
            Self::Left => (0, -1),
            Self::Right => (0, 1),
        }
    }

    /// Returns the action with a given number.
    ///
    /// # Errors
    /// [`Error::Action`] unless the number is 0 to 4. POGEMA's list indexing would read `-1` as Right.
    ///
    /// Rule: move/invalid
    pub fn from_number(agent: usize, number: i64) -> Result<Self, Error> {
        Self::try_from(number).map_err(|_| Error::Action { agent: Some(agent), number })
    }
}

impl TryFrom<i64> for Action {
    type Error = Error;

    fn try_from(number: i64) -> Result<Self, Error> {
        let known = usize::try_from(number).ok().and_then(|at| Self::ALL.get(at));
        known.copied().ok_or(Error::Action { agent: None, number })
    }
}

impl From<Action> for u8 {
    fn from(action: Action) -> Self {
        action as Self
    }
}
