//! The data that all searches of a step share: the map and the costs to go.

use std::sync::{Mutex, PoisonError};

use pogema_core::{Action, Cell, Error, Map, State};

use crate::encode::costs::{CostGrid, Costs};
use crate::grid::Layout;

/// The map and the costs to go of an episode.
#[derive(Debug)]
pub(super) struct World {
    pub layout: Layout,
    free: Vec<bool>,
    /// The offset that each action adds to a place.
    offsets: [isize; Action::ALL.len()],
    costs: Mutex<Costs>,
}

impl World {
    /// Prepares a map for networks that see at most `radius` cells in each direction.
    pub fn new(map: &Map, radius: usize) -> Self {
        let layout = Layout::new(map, radius);
        let mut free = vec![false; layout.len()];
        for (index, _) in map.obstacles().iter().enumerate().filter(|&(_, &obstacle)| !obstacle) {
            free[layout.place(map.cell_at(index))] = true;
        }
        let offsets = Action::ALL.map(|action| {
            let (down, right) = action.delta();
            down as isize * layout.stride() as isize + right as isize
        });
        Self { layout, free, offsets, costs: Mutex::new(Costs::new(layout, map)) }
    }

    /// Returns whether a place is a free cell of the map.
    pub fn is_free(&self, place: u32) -> bool {
        self.free[place as usize]
    }

    /// Returns the place that an action leads to.
    pub fn toward(&self, place: u32, action: Action) -> u32 {
        (place as isize + self.offsets[action as usize]) as u32
    }

    /// Returns whether an action leads from a place to a free cell. An agent can always wait.
    pub fn is_possible(&self, place: u32, action: Action) -> bool {
        action == Action::Stay || self.is_free(self.toward(place, action))
    }

    /// Returns the costs to go to a goal.
    pub fn costs_to(&self, goal: Cell) -> CostGrid {
        // A panic cannot leave the cache half written, because a grid is complete before it is inserted.
        self.costs.lock().unwrap_or_else(PoisonError::into_inner).grid(goal)
    }

    /// Checks that cells lie on the map; `what` names them in the error.
    ///
    /// # Errors
    /// [`Error::Agent`] for the first cell outside the map.
    pub fn check_inside(&self, what: &str, cells: &[Cell]) -> Result<(), Error> {
        self.layout.check_inside(what, cells)
    }

    /// Advances to a state, and writes the smallest cost that each agent has had to its current goal.
    pub fn follow(&mut self, now: State<'_>, best: &mut Vec<i32>) {
        let costs = self.costs.get_mut().unwrap_or_else(PoisonError::into_inner);
        costs.follow(now);
        best.clear();
        best.extend((0..now.cells.len()).map(|agent| costs.of(agent).best));
    }
}
