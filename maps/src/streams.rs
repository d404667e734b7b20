//! Where an agent's next goal is drawn from in lifelong mode.

use std::sync::Arc;

use pogema_core::{Cell, GoalSource};

use crate::components::{ComponentCells, Components};
use pogema_numpy::Generator;

/// Draws from the cells that the agent can reach, all but the one it stands on.
///
/// Rule: goal/restart/draw, seed/goals
///
/// Source: POGEMA 1.4.0, `generator.py`, `generate_new_target`
#[derive(Clone, Debug)]
pub struct ComponentSource {
    generator: Generator,
    reach: Arc<Reach>,
}

/// What all agents of a map share to draw goals from.
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
    pub fn from(&self, cell: Cell) -> &[Cell] {
        self.components.label(cell).map_or(&[], |label| self.cells.of(label))
    }
}

impl ComponentSource {
    /// A source with its own random numbers.
    pub fn new(generator: Generator, reach: Arc<Reach>) -> Self {
        Self { generator, reach }
    }
}

impl GoalSource for ComponentSource {
    fn next_goal(&mut self, at: Cell) -> Cell {
        draw_until(&mut self.generator, self.reach.from(at), |cell| cell != at).unwrap_or(at)
    }

    fn save(&self) -> Option<String> {
        serde_json::to_string(&self.generator).ok()
    }

    fn restore(&mut self, saved: &str) -> bool {
        restore(&mut self.generator, saved)
    }

    fn boxed_clone(&self) -> Box<dyn GoalSource> {
        Box::new(self.clone())
    }
}

/// Draws from the possible goals.
///
/// POGEMA means to leave out the cell the agent stands on, but compares a cell of the map with one that counts
/// the border, so it leaves out the cell that lies one radius below and to the right.
///
/// Rule: goal/restart/pool
///
/// Source: POGEMA 1.4.0, `generator.py`, `generate_from_possible_targets`
#[derive(Clone, Debug)]
pub struct PoolSource {
    generator: Generator,
    pool: Arc<[Cell]>,
    radius: u16,
}

impl PoolSource {
    /// A source with its own random numbers.
    pub fn new(generator: Generator, pool: Arc<[Cell]>, radius: u16) -> Self {
        Self { generator, pool, radius }
    }

    /// Whether a goal can be drawn at all for an agent at `at`.
    pub fn can_draw(pool: &[Cell], radius: u16, at: Cell) -> bool {
        pool.iter().any(|&cell| cell != left_out(radius, at))
    }
}

impl GoalSource for PoolSource {
    fn next_goal(&mut self, at: Cell) -> Cell {
        let left_out = left_out(self.radius, at);
        draw_until(&mut self.generator, &self.pool, |cell| cell != left_out).unwrap_or(at)
    }

    fn save(&self) -> Option<String> {
        serde_json::to_string(&self.generator).ok()
    }

    fn restore(&mut self, saved: &str) -> bool {
        restore(&mut self.generator, saved)
    }

    fn boxed_clone(&self) -> Box<dyn GoalSource> {
        Box::new(self.clone())
    }
}

/// Puts a saved generator into the place of another; says whether the text was one.
fn restore(generator: &mut Generator, saved: &str) -> bool {
    let read = serde_json::from_str(saved);
    read.map(|read| *generator = read).is_ok()
}

fn left_out(radius: u16, at: Cell) -> Cell {
    Cell::new(at.row.saturating_add(radius), at.col.saturating_add(radius))
}

/// Draws until a cell fits; none if no cell does, where POGEMA would draw for ever.
fn draw_until(generator: &mut Generator, cells: &[Cell], fits: impl Fn(Cell) -> bool) -> Option<Cell> {
    if !cells.iter().any(|&cell| fits(cell)) {
        return None;
    }
    loop {
        let cell = cells[generator.choice_index(cells.len()).ok()?];
        if fits(cell) {
            return Some(cell);
        }
    }
}
