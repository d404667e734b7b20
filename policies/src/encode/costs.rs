//! Costs to go as padded grids, one per goal, shared by all agents with that goal.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use pogema_core::{Cell, Config, Error, Map, State};
use pogema_planners::{Bfs, Graph, UNREACHABLE};

use crate::grid::Layout;

/// Steps from each place to one goal.
///
/// Many agents read many grids, so speed depends on the size of an entry. The largest value of an entry stands for
/// [`NO_COST`].
#[derive(Clone, Debug)]
pub(crate) enum CostGrid {
    /// The costs of maps with few free cells.
    Small(Arc<[u16]>),
    Large(Arc<[u32]>),
}

impl CostGrid {
    /// Creates a grid from costs; a place without a cost has `u32::MAX`.
    fn new(costs: Vec<u32>, num_free: usize) -> Self {
        if num_free < usize::from(u16::MAX) - FARTHEST {
            // A path is shorter than the number of free cells, so only the value of a missing cost is truncated.
            Self::Small(costs.into_iter().map(|cost| cost as u16).collect())
        } else {
            Self::Large(costs.into())
        }
    }

    /// Returns the cost of a place, or [`NO_COST`].
    pub fn at(&self, place: usize) -> i32 {
        match self {
            Self::Small(costs) => widened(costs[place]),
            Self::Large(costs) => costs[place] as i32,
        }
    }

    /// Copies the costs of the window around a place.
    fn copy_window(&self, layout: Layout, place: usize, window: &mut [i32]) {
        match self {
            Self::Small(costs) => layout.map_window(costs, place, window, widened),
            Self::Large(costs) => layout.map_window(costs, place, window, |cost| cost as i32),
        }
    }

    fn is_shared(&self) -> bool {
        match self {
            Self::Small(costs) => Arc::strong_count(costs) > 1,
            Self::Large(costs) => Arc::strong_count(costs) > 1,
        }
    }
}

fn widened(cost: u16) -> i32 {
    if cost == u16::MAX { NO_COST } else { i32::from(cost) }
}

/// The largest difference of costs that a window shows: twice the largest radius.
const FARTHEST: usize = 2 * Config::LARGEST_RADIUS;

/// The entry of a place from which no path leads to the goal.
pub(crate) const NO_COST: i32 = -1;

/// The cost grids of an environment.
#[derive(Debug)]
pub(crate) struct Costs {
    layout: Layout,
    graph: Graph,
    bfs: Bfs,
    grids: HashMap<Cell, CostGrid>,
    max_grids: usize,
    agents: Vec<ToGoal>,
}

/// The costs of an agent to its goal.
#[derive(Clone, Debug)]
pub(crate) struct ToGoal {
    pub goal: Cell,
    pub grid: CostGrid,
    /// The cost of the agent's cell, and the smallest so far for this goal.
    pub now: i32,
    pub best: i32,
}

impl Costs {
    /// Default byte budget of the grids that no agent currently uses.
    pub const DEFAULT_BYTES: usize = 64 << 20;

    pub fn new(layout: Layout, map: &Map) -> Self {
        Self::with_budget(layout, map, Self::DEFAULT_BYTES)
    }

    pub fn with_budget(layout: Layout, map: &Map, max_bytes: usize) -> Self {
        let graph = Graph::new(map);
        let max_grids = (max_bytes / (size_of::<u32>() * layout.len())).max(1);
        Self { layout, bfs: Bfs::new(&graph), graph, grids: HashMap::new(), max_grids, agents: Vec::new() }
    }

    /// Begins an episode on the same map.
    pub fn begin(&mut self) {
        self.agents.clear();
    }

    /// Advances to a state: a new goal gets its grid, and the smallest cost is reset.
    pub fn follow(&mut self, state: State<'_>) {
        // INVARIANT: nothing sets this flag.
        let _ = self.follow_until(state, &AtomicBool::new(false));
    }

    /// Advances to a state like [`Costs::follow`].
    ///
    /// # Errors
    /// [`Error::Cancelled`] if another thread sets `stop`.
    pub fn follow_until(&mut self, state: State<'_>, stop: &AtomicBool) -> Result<(), Error> {
        for (agent, (&cell, &goal)) in state.cells.iter().zip(state.goals).enumerate() {
            let place = self.layout.place(cell);
            match self.agents.get_mut(agent) {
                Some(known) if known.goal == goal => {
                    known.now = known.grid.at(place);
                    known.best = known.best.min(known.now);
                }
                _ if stop.load(Relaxed) => return Err(Error::Cancelled),
                _ => {
                    let grid = self.grid(goal);
                    let now = grid.at(place);
                    let entry = ToGoal { goal, grid, now, best: now };
                    match self.agents.get_mut(agent) {
                        Some(known) => *known = entry,
                        None => self.agents.push(entry),
                    }
                }
            }
        }
        Ok(())
    }

    /// Returns the costs of an agent to its goal.
    pub fn of(&self, agent: usize) -> &ToGoal {
        &self.agents[agent]
    }

    /// Returns the costs to a goal.
    pub fn grid(&mut self, goal: Cell) -> CostGrid {
        if let Some(grid) = self.grids.get(&goal) {
            return grid.clone();
        }
        if self.grids.len() >= self.max_grids {
            self.grids.retain(|_, grid| grid.is_shared());
        }
        let mut costs = vec![UNREACHABLE; self.layout.len()];
        if let Some(vertex) = self.graph.vertex(goal) {
            for (vertex, cost) in self.bfs.costs_to_go(vertex).enumerate() {
                costs[self.layout.place(self.graph.cell(vertex as u32))] = cost;
            }
        }
        let grid = CostGrid::new(costs, self.graph.num_vertices());
        self.grids.insert(goal, grid.clone());
        grid
    }
}

/// Writes the window of `cost_to_go`: `(cost of the agent's cell - cost) / (2 * radius)`, limited to -1 to 1.
pub(crate) fn write_plain(layout: Layout, costs: &ToGoal, place: usize, radius: usize, out: &mut [f32]) {
    if costs.now == NO_COST {
        return out.fill(-1.0);
    }
    let most = (2 * radius) as f32;
    match &costs.grid {
        // Floats, because all processors have vector instructions for their minimum and maximum. They are exact up to
        // 2^24. The entry of a place without a cost is so large that the result is the lower limit.
        CostGrid::Small(grid) => {
            let now = costs.now as f32;
            layout.map_window(grid, place, out, |cost| (now - f32::from(cost)).clamp(-most, most) / most);
        }
        CostGrid::Large(grid) => {
            let limit = 2 * radius as i32;
            layout.map_window(grid, place, out, |cost| {
                let nearer =
                    if cost == u32::MAX { -limit } else { (costs.now - cost as i32).clamp(-limit, limit) };
                nearer as f32 / most
            });
        }
    }
}

/// Writes the window of `cost_tracer`.
///
/// `window` is a scratch buffer for the costs of the window.
pub(crate) fn write_tracer(
    layout: Layout,
    costs: &ToGoal,
    place: usize,
    window: &mut [i32],
    out: &mut [f32],
) {
    let centre = out.len() / 2;
    if costs.now == NO_COST {
        out.fill(0.0);
        out[centre] = -1.0;
        return;
    }
    costs.grid.copy_window(layout, place, window);
    let (mut largest, mut smallest, mut is_missing) = (NO_COST, i32::MAX, false);
    for &cost in &*window {
        largest = largest.max(cost);
        smallest = smallest.min(if cost == NO_COST { i32::MAX } else { cost });
        is_missing |= cost == NO_COST;
    }
    // Cells without a cost count as four steps farther than the farthest cell.
    let farthest = if is_missing { largest + 4 } else { largest };
    let span = (farthest - smallest) as f32;
    for (value, &cost) in out.iter_mut().zip(&*window) {
        let nearer = if cost == NO_COST { 0 } else { farthest - cost };
        *value = nearer as f32 / span;
    }
    let behind = (costs.now - costs.best + 1) as f32 / 64.0;
    out[centre] = -behind.min(1.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sizes_of_entries_hold_the_same_costs() {
        let map = Map::new(5, 5, vec![false; 25]).unwrap_or_else(|error| panic!("{error}"));
        let layout = Layout::new(&map, 1);
        let costs: Vec<u32> =
            (0..layout.len() as u32).map(|x| if x % 3 == 0 { UNREACHABLE } else { x }).collect();
        let (small, large) = (CostGrid::new(costs.clone(), 65_278), CostGrid::new(costs, 65_279));
        assert!(matches!((&small, &large), (CostGrid::Small(_), CostGrid::Large(_))));
        let windows = [&small, &large].map(|grid| {
            let mut window = [0; 9];
            grid.copy_window(layout, layout.place(Cell::new(2, 3)), &mut window);
            window
        });
        assert_eq!(windows[0], windows[1]);
        assert!((0..layout.len()).all(|place| small.at(place) == large.at(place)));
        assert_eq!([small.at(0), large.at(3), small.at(4)], [NO_COST, NO_COST, 4]);
    }
}
