//! Where an agent's next goal is drawn from in lifelong mode.

use std::sync::Arc;

use pogema_core::{Cell, GoalSource};

use crate::components::{ComponentCells, Components};
use pogema_numpy::Generator;

/// Draws the next goals of one agent.
///
/// Rule: goal/restart/draw, seed/goals
#[derive(Clone, Debug)]
pub struct DrawnGoals {
    generator: Generator,
    choice: Choice,
}

/// The cells that a goal is drawn from. All agents of a map share them.
#[derive(Clone, Debug)]
pub enum Choice {
    /// The cells that the agent can reach, all but the one it stands on.
    ///
    /// Source: POGEMA 1.4.0, `generator.py`, `generate_new_target`
    Reach(Arc<Reach>),
    /// The possible goals.
    ///
    /// POGEMA means to leave out the cell the agent stands on, but compares a cell of the map with one that counts
    /// the border, so it leaves out the cell that lies one radius below and to the right.
    ///
    /// Rule: goal/restart/pool
    ///
    /// Source: POGEMA 1.4.0, `generator.py`, `generate_from_possible_targets`
    Pool { cells: Arc<[Cell]>, radius: u16 },
}

/// The cells that can be reached from each cell of a map.
#[derive(Debug)]
pub struct Reach {
    components: Components,
    cells: ComponentCells,
}

impl Reach {
    /// The reach of every cell of a map.
    pub fn new(components: Components) -> Self {
        let cells = components.cells();
        Self { components, cells }
    }

    /// The cells that can be reached from a cell, itself included; none from an obstacle.
    fn from(&self, cell: Cell) -> &[Cell] {
        self.components.label(cell).map_or(&[], |label| self.cells.of(label))
    }
}

impl Choice {
    /// The cells to draw from for an agent at `at`, and the one among them that does not count.
    fn cells(&self, at: Cell) -> (&[Cell], Cell) {
        match self {
            Self::Reach(reach) => (reach.from(at), at),
            Self::Pool { cells, radius } => {
                (cells, Cell::new(at.row.saturating_add(*radius), at.col.saturating_add(*radius)))
            }
        }
    }

    /// Whether a goal can be drawn at all for an agent at `at`.
    pub fn can_draw(&self, at: Cell) -> bool {
        let (cells, left_out) = self.cells(at);
        cells.iter().any(|&cell| cell != left_out)
    }
}

impl DrawnGoals {
    /// A source with its own random numbers.
    pub fn new(generator: Generator, choice: Choice) -> Self {
        Self { generator, choice }
    }
}

impl GoalSource for DrawnGoals {
    /// Draws until a cell counts. Where none does, POGEMA would draw for ever; the agent keeps its goal here.
    fn next_goal(&mut self, at: Cell) -> Cell {
        let (cells, left_out) = self.choice.cells(at);
        if cells.iter().all(|&cell| cell == left_out) {
            return at;
        }
        loop {
            let Ok(index) = self.generator.choice_index(cells.len()) else { return at };
            if cells[index] != left_out {
                return cells[index];
            }
        }
    }

    fn save(&self) -> Option<String> {
        serde_json::to_string(&self.generator).ok()
    }

    fn restore(&mut self, saved: &str) -> bool {
        serde_json::from_str(saved).map(|generator| self.generator = generator).is_ok()
    }

    fn boxed_clone(&self) -> Box<dyn GoalSource> {
        Box::new(self.clone())
    }
}
