//! Groups: the agents that are planned together.

use pogema_core::{Action, Cell};

use crate::mats_lp::params::MatsLpParams;
use crate::mats_lp::world::World;

/// Finds the groups of a state.
#[derive(Debug)]
pub(super) struct Groups<'a> {
    world: &'a World,
    cells: &'a [Cell],
    /// The agent on each place, or `NO_AGENT`.
    occupants: Vec<u32>,
    /// For each place, the last search that has reached it, counted from 1.
    reached: Vec<u32>,
    num_searches: u32,
    frontier: Vec<u32>,
    next: Vec<u32>,
}

const NO_AGENT: u32 = u32::MAX;

impl<'a> Groups<'a> {
    /// Prepares a state. Inactive agents belong to no group.
    pub fn new(world: &'a World, cells: &'a [Cell], active: &[bool]) -> Self {
        let mut occupants = vec![NO_AGENT; world.layout.len()];
        for (agent, &cell) in cells.iter().enumerate().filter(|&(agent, _)| active[agent]) {
            occupants[world.layout.place(cell)] = agent as u32;
        }
        let reached = vec![0; world.layout.len()];
        Self { world, cells, occupants, reached, num_searches: 0, frontier: Vec::new(), next: Vec::new() }
    }

    /// Returns the group of an agent: first the agent, then the others in the order of a breadth-first search.
    ///
    /// The search tries the actions up, down, left, right. Agents do not block it.
    pub fn of(&mut self, agent: usize, params: &MatsLpParams) -> Vec<usize> {
        let mut group = vec![agent];
        self.num_searches += 1;
        let start = self.world.layout.place(self.cells[agent]) as u32;
        self.reached[start as usize] = self.num_searches;
        self.frontier.clear();
        self.frontier.push(start);
        for _ in 1..params.merging_range {
            for &place in &self.frontier {
                for &action in &Action::ALL[1..] {
                    let target = self.world.toward(place, action);
                    let reached = &mut self.reached[target as usize];
                    if !self.world.is_free(target) || *reached == self.num_searches {
                        continue;
                    }
                    *reached = self.num_searches;
                    self.next.push(target);
                    let other = self.occupants[target as usize];
                    if other != NO_AGENT
                        && is_within(self.cells[agent], self.cells[other as usize], params.radius)
                    {
                        group.push(other as usize);
                    }
                }
            }
            self.frontier.clear();
            std::mem::swap(&mut self.frontier, &mut self.next);
        }
        group
    }
}

fn is_within(one: Cell, other: Cell, radius: u32) -> bool {
    u32::from(one.row.abs_diff(other.row).max(one.col.abs_diff(other.col))) <= radius
}
