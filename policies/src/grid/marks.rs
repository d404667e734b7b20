//! The occupancy grid of an environment, derived from its states.

use pogema_core::{Occupancy, State};

use crate::grid::layout::Layout;

/// The marks of an occupancy grid: 1 for a cell that counts as occupied, else 0.
///
/// They equal the marks of the engine if every state of the episode is followed. After a gap, the marks are those of
/// the cells of all active agents.
#[derive(Clone, Debug)]
pub(crate) struct Marks {
    layout: Layout,
    occupancy: Occupancy,
    grid: Vec<f32>,
    /// The place of each agent in the last state; `None` for an inactive agent.
    places: Vec<Option<usize>>,
    step: Option<u64>,
}

impl Marks {
    pub fn new(layout: Layout, occupancy: Occupancy) -> Self {
        Self { layout, occupancy, grid: vec![0.0; layout.len()], places: Vec::new(), step: None }
    }

    /// Returns the marks, one value per place.
    pub fn grid(&self) -> &[f32] {
        &self.grid
    }

    /// Advances to a state.
    ///
    /// Rule: occupancy/as-released, occupancy/exact
    pub fn follow(&mut self, state: State<'_>) {
        let is_next = self.step.is_some_and(|step| step + 1 == state.step);
        let is_followed = is_next && self.places.len() == state.cells.len();
        if !is_followed || self.occupancy == Occupancy::Exact {
            for &place in self.places.iter().flatten() {
                self.grid[place] = 0.0;
            }
            self.places.clear();
            self.places.resize(state.cells.len(), None);
        }
        self.step = Some(state.step);
        let Self { grid, places, layout, .. } = self;
        // In the order of the indices: an agent that leaves a cell erases the mark of an agent with a lower index that
        // entered it.
        for ((&cell, &is_active), place) in state.cells.iter().zip(state.active).zip(places) {
            if let Some(left) = place.take() {
                grid[left] = 0.0;
            }
            if is_active {
                let entered = layout.place(cell);
                grid[entered] = 1.0;
                *place = Some(entered);
            }
        }
    }
}
