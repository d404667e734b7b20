//! The priorities of PIBT, which grow until an agent reaches its goal.

use crate::problem::Agent;

/// The mask of the constant lower bits of a priority, which differ between agents. The upper bits count the steps since
/// the agent was last on its goal.
const RANK: u32 = 0xf_ffff;

/// Returns the initial priorities: the higher the cost of an agent, the higher its priority.
pub(crate) fn initial_priorities(num_agents: usize, cost: impl Fn(Agent) -> u32) -> Vec<u32> {
    let mut ranks: Vec<Agent> = (0..num_agents as Agent).collect();
    ranks.sort_by_key(|&agent| cost(agent));
    let mut priorities = vec![0; num_agents];
    for (rank, &agent) in ranks.iter().enumerate() {
        priorities[agent as usize] = rank as u32;
    }
    priorities
}

/// Returns the priority of an agent after a step.
pub(crate) fn next_priority(priority: u32, is_on_goal: bool) -> u32 {
    match priority.checked_add(RANK + 1) {
        _ if is_on_goal => priority & RANK,
        Some(more) => more,
        // The counter saturates; ranks stay distinct.
        None => priority,
    }
}

/// Sorts agents by priority, highest first.
pub(crate) fn sort_by_priority(order: &mut [Agent], priorities: &[u32]) {
    order.sort_unstable_by_key(|&agent| (std::cmp::Reverse(priorities[agent as usize]), agent));
}

/// The priorities of all agents, and the order in which they choose.
#[derive(Debug)]
pub(crate) struct Priorities {
    values: Vec<u32>,
    order: Vec<Agent>,
}

impl Priorities {
    /// Creates the initial priorities: the higher the cost of an agent, the higher its priority.
    pub fn new(num_agents: usize, cost: impl Fn(Agent) -> u32) -> Self {
        let values = initial_priorities(num_agents, cost);
        let order = (0..num_agents as Agent).collect();
        Self { values, order }
    }

    /// Returns all agents, highest priority first.
    pub fn order(&mut self) -> &[Agent] {
        sort_by_priority(&mut self.order, &self.values);
        &self.order
    }

    /// Updates the priorities after a step.
    pub fn update(&mut self, is_on_goal: impl Fn(usize) -> bool) {
        for (agent, priority) in self.values.iter_mut().enumerate() {
            *priority = next_priority(*priority, is_on_goal(agent));
        }
    }
}
