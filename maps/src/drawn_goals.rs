//! Draws the next goals of the agents in lifelong mode.

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

/// The cells from which a goal is drawn, shared by all agents of a map.
#[derive(Clone, Debug)]
pub enum Choice {
    /// The cells that the agent can reach, except its own.
    ///
    /// Source: POGEMA 1.4.0, `generator.py`, `generate_new_target`
    Reach(Arc<Reach>),
    /// The possible goals.
    ///
    /// POGEMA intends to exclude the agent's own cell, but compares coordinates without the border with coordinates
    /// that include it. POGEMA therefore excludes the cell that lies one radius below and one radius to the right of
    /// the agent's cell.
    ///
    /// Rule: goal/restart/pool
    ///
    /// Source: POGEMA 1.4.0, `generator.py`, `generate_from_possible_targets`
    Pool { cells: Arc<[Cell]>, radius: u16 },
}

/// The cells reachable from each cell of a map.
#[derive(Debug)]
pub struct Reach {
    components: Components,
    cells: ComponentCells,
}

impl Reach {
    /// Collects the reachable cells of every cell of a map.
    pub fn new(components: Components) -> Self {
        let cells = components.cells();
        Self { components, cells }
    }

    /// Returns the cells reachable from a cell, itself included; none for an obstacle.
    fn from(&self, cell: Cell) -> &[Cell] {
        self.components.label(cell).map_or(&[], |label| self.cells.of(label))
    }
}

impl Choice {
    /// Returns the cells to draw from for an agent at `at`, and the cell that is excluded.
    fn cells(&self, at: Cell) -> (&[Cell], Cell) {
        match self {
            Self::Reach(reach) => (reach.from(at), at),
            Self::Pool { cells, radius } => {
                (cells, Cell::new(at.row.saturating_add(*radius), at.col.saturating_add(*radius)))
            }
        }
    }

    /// Returns whether any goal can be drawn for an agent at `at`.
    pub fn can_draw(&self, at: Cell) -> bool {
        let (cells, excluded) = self.cells(at);
        cells.iter().any(|&cell| cell != excluded)
    }
}

impl DrawnGoals {
    /// Creates a source with its own random numbers.
    pub fn new(generator: Generator, choice: Choice) -> Self {
        Self { generator, choice }
    }
}

impl GoalSource for DrawnGoals {
    /// Draws cells until one is not excluded. If no such cell exists, POGEMA would draw forever; here the agent keeps
    /// its goal.
    fn next_goal(&mut self, at: Cell) -> Cell {
        if !self.choice.can_draw(at) {
            return at;
        }
        let (cells, excluded) = self.choice.cells(at);
        loop {
            let Ok(index) = self.generator.choice_index(cells.len()) else { return at };
            if cells[index] != excluded {
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
