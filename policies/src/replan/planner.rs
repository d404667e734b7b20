//! RePlan's planner: the memory of the agents, and one search for each agent in every step.

use pogema_core::{Action, Cell, Instance, Occupancy, State};

use crate::grid::{Layout, Marks};
use crate::replan::place::{Place, toward};
use crate::replan::search::{Query, Search};

/// The two versions of RePlan that its authors released.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReplanVersion {
    /// The C++ version, with which ASwitcher plans. Without a path it has no move.
    Cpp,
    /// The Python version, which plays alone and in LSwitcher. Without a path it moves towards the expanded cell
    /// nearest to the goal.
    Python,
}

impl ReplanVersion {
    /// Returns the order in which the neighbours of a cell are generated.
    fn moves(self) -> [Action; 4] {
        match self {
            Self::Cpp => [Action::Right, Action::Down, Action::Up, Action::Left],
            Self::Python => Action::MOVES,
        }
    }
}

/// The planner of all agents of an episode.
#[derive(Clone, Debug)]
pub(crate) struct Replanner {
    version: ReplanVersion,
    layout: Layout,
    sight: usize,
    obstacles: Vec<f32>,
    present: Marks,
    agents: Vec<Agent>,
    search: Search,
}

/// The memory of an agent.
#[derive(Clone, Debug)]
struct Agent {
    /// For each place, whether the agent has seen an obstacle there.
    known: Vec<bool>,
    /// The cell where the agent was when it planned last, and the next cell of that plan.
    last: Option<(Place, Option<Place>)>,
    /// Cells that the agent did not reach, although they were next in its plan.
    failed: Vec<Place>,
    /// The last two cells where the plan had a move, the latest first.
    trail: [Option<Place>; 2],
}

/// The plan of an agent for one step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Plan {
    /// The agent is on its goal or inactive, or the search finds no move.
    None,
    /// The first move of the path.
    Move(Action),
    /// The first move of the path, which leads to one of the last two cells.
    Return(Action),
}

impl Replanner {
    /// Begins an episode. `sight` is the number of cells that an agent sees in each direction.
    pub fn begin(version: ReplanVersion, instance: &Instance, occupancy: Occupancy, sight: usize) -> Self {
        let layout = Layout::new(instance.map(), sight);
        let agent =
            Agent { known: vec![false; layout.len()], last: None, failed: Vec::new(), trail: [None; 2] };
        Self {
            version,
            layout,
            sight,
            obstacles: layout.obstacles(instance.map(), instance.outside()),
            present: Marks::new(layout, occupancy),
            agents: vec![agent; instance.starts().len()],
            search: Search::default(),
        }
    }

    /// Plans for all agents.
    pub fn plan(&mut self, state: State<'_>) -> Vec<Plan> {
        self.present.follow(state);
        let agents = state.cells.iter().zip(state.goals).zip(state.active).enumerate();
        agents
            .map(
                |(agent, ((&cell, &goal), &is_active))| {
                    if is_active && cell != goal { self.plan_one(agent, cell, goal) } else { Plan::None }
                },
            )
            .collect()
    }

    /// Returns the obstacle map with its layout.
    pub fn obstacles(&self) -> (Layout, &[f32]) {
        (self.layout, &self.obstacles)
    }

    fn plan_one(&mut self, agent: usize, cell: Cell, goal: Cell) -> Plan {
        let (layout, sight) = (self.layout, self.sight);
        let agent = &mut self.agents[agent];
        let side = 2 * sight + 1;
        for first in layout.window_rows(layout.place(cell), sight) {
            let row = first..first + side;
            for (known, &obstacle) in agent.known[row.clone()].iter_mut().zip(&self.obstacles[row]) {
                *known |= obstacle != 0.0;
            }
        }
        let start = place(cell);
        let avoids = agent.note_failure(start);
        let (known, failed) = (&agent.known, &agent.failed);
        let is_blocked = |at: Place| {
            let Some(index) = layout.find_place(at.0, at.1) else { return false };
            let is_near = at.0.abs_diff(start.0).max(at.1.abs_diff(start.1)) as usize <= sight;
            let is_occupied = is_near && self.present.grid()[index] != 0.0;
            known[index] || is_occupied || (avoids && failed.contains(&at))
        };
        let query = Query {
            start,
            goal: place(goal),
            moves: self.version.moves(),
            best_move: self.version == ReplanVersion::Python,
        };
        let next = self.search.first_step(query, is_blocked);
        agent.last = Some((start, next));
        let Some(next) = next else { return Plan::None };
        let action = Action::ALL.into_iter().find(|&action| toward(start, action) == next);
        // INVARIANT: a path leads from a cell to a neighbour.
        let action = action.unwrap_or(Action::Stay);
        let returns = agent.trail[1].is_some() && agent.trail.contains(&Some(next));
        agent.trail = [Some(start), agent.trail[0]];
        if returns { Plan::Return(action) } else { Plan::Move(action) }
    }
}

impl Agent {
    /// If the last plan had a next cell and the agent is not there, adds that cell to the failed ones; otherwise clears
    /// them. Returns whether the new plan avoids them.
    fn note_failure(&mut self, at: Place) -> bool {
        match self.last {
            Some((from, Some(next))) if next != at => {
                self.failed.push(next);
                from == at
            }
            _ => {
                self.failed.clear();
                false
            }
        }
    }
}

fn place(cell: Cell) -> Place {
    (i32::from(cell.row), i32::from(cell.col))
}
