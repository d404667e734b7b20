//! Costs to go as padded grids, one per goal, shared by all agents with that goal.

use std::collections::HashMap;
use std::sync::Arc;

use pogema_core::{Cell, Map, State};
use pogema_planners::{Bfs, Graph, UNREACHABLE};

use crate::grid::Layout;

/// Steps from each place to one goal, or [`NO_COST`].
pub(crate) type CostGrid = Arc<[i32]>;

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
    /// Byte budget of the grids that no agent uses at present.
    const MAX_BYTES: usize = 64 << 20;

    pub fn new(layout: Layout, map: &Map) -> Self {
        let graph = Graph::new(map);
        let max_grids = (Self::MAX_BYTES / (size_of::<i32>() * layout.len())).max(1);
        Self { layout, bfs: Bfs::new(&graph), graph, grids: HashMap::new(), max_grids, agents: Vec::new() }
    }

    /// Advances to a state: a new goal gets its grid, and the smallest cost begins anew.
    pub fn follow(&mut self, state: State<'_>) {
        for (agent, (&cell, &goal)) in state.cells.iter().zip(state.goals).enumerate() {
            let place = self.layout.place(cell);
            match self.agents.get_mut(agent) {
                Some(known) if known.goal == goal => {
                    known.now = known.grid[place];
                    known.best = known.best.min(known.now);
                }
                _ => {
                    let grid = self.grid(goal);
                    let now = grid[place];
                    let entry = ToGoal { goal, grid, now, best: now };
                    match self.agents.get_mut(agent) {
                        Some(known) => *known = entry,
                        None => self.agents.push(entry),
                    }
                }
            }
        }
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
            self.grids.retain(|_, grid| Arc::strong_count(grid) > 1);
        }
        let mut grid = vec![NO_COST; self.layout.len()];
        if let Some(vertex) = self.graph.vertex(goal) {
            let costs = self.bfs.costs_to_go(vertex).enumerate();
            for (vertex, cost) in costs.filter(|&(_, cost)| cost != UNREACHABLE) {
                grid[self.layout.place(self.graph.cell(vertex as u32))] = cost as i32;
            }
        }
        let grid: CostGrid = grid.into();
        self.grids.insert(goal, grid.clone());
        grid
    }
}

/// Writes the window of `cost_to_go`: `(cost of the own cell - cost) / (2 * radius)`, limited to -1 to 1.
///
/// `window` is memory for the costs of the window.
pub(crate) fn write_plain(layout: Layout, costs: &ToGoal, place: usize, window: &mut [i32], out: &mut [f32]) {
    if costs.now == NO_COST {
        return out.fill(-1.0);
    }
    layout.copy_window(&costs.grid, place, window);
    let most = out.len().isqrt() as i32 - 1;
    for (value, &cost) in out.iter_mut().zip(&*window) {
        let nearer = if cost == NO_COST { -most } else { (costs.now - cost).clamp(-most, most) };
        *value = nearer as f32 / most as f32;
    }
}

/// Writes the window of `cost_tracer`.
///
/// `window` is memory for the costs of the window.
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
    layout.copy_window(&costs.grid, place, window);
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
