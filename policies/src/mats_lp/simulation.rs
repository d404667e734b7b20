//! The environment of a search: the agents of one group, without any other agents.

use pogema_core::{Action, Cell};

use crate::encode::costs::{CostGrid, ToGoal, write_tracer};
use crate::mats_lp::cache::Key;
use crate::mats_lp::soft::withdraw_conflicts;
use crate::mats_lp::world::World;

/// An agent of a group in a simulated state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GroupAgent {
    pub cell: Cell,
    /// The index of the current goal in the list of the agent's goals.
    goal: u32,
    /// The cost to go, and the smallest so far for this goal.
    now: i32,
    best: i32,
    /// Whether the agent has reached its last goal. It then stays there.
    is_done: bool,
}

/// The goals of an agent from the root on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goals<'a> {
    /// The current goal and later ones, as many as are known.
    pub list: &'a [Cell],
    /// Whether an agent that reaches its last goal gets this goal again. Otherwise, the agent stays.
    pub repeats_last: bool,
}

/// A group in a simulated state, and its root.
#[derive(Debug)]
pub(super) struct Simulation<'a> {
    world: &'a World,
    goals: Vec<Goals<'a>>,
    /// For each agent, the costs to its goals, as far as a simulation has reached them.
    grids: Vec<Vec<CostGrid>>,
    root: Vec<GroupAgent>,
    agents: Vec<GroupAgent>,
    progress_reward: f64,
    places: Vec<u32>,
    targets: Vec<u32>,
    moves: Vec<bool>,
}

impl<'a> Simulation<'a> {
    /// Creates a simulation of no agents.
    pub fn new(world: &'a World, progress_reward: f64) -> Self {
        Self {
            world,
            goals: Vec::new(),
            grids: Vec::new(),
            root: Vec::new(),
            agents: Vec::new(),
            progress_reward,
            places: Vec::new(),
            targets: Vec::new(),
            moves: Vec::new(),
        }
    }

    /// Adds an agent to the root, after those already in the group; `best` is its smallest cost so far.
    pub fn add(&mut self, cell: Cell, goals: Goals<'a>, best: i32) {
        let grid = self.world.costs_to(goals.list[0]);
        let now = grid.at(self.world.layout.place(cell));
        let agent = GroupAgent { cell, goal: 0, now, best, is_done: false };
        self.goals.push(goals);
        self.grids.push(vec![grid]);
        self.root.push(agent);
        self.agents.push(agent);
        self.moves.push(false);
        let place = self.world.layout.place(cell) as u32;
        self.places.push(place);
        self.targets.push(place);
    }

    /// Returns the agents of the group in the current state.
    pub fn agents(&self) -> &[GroupAgent] {
        &self.agents
    }

    /// Returns to the root.
    pub fn restart(&mut self) {
        self.agents.copy_from_slice(&self.root);
        for (place, agent) in self.places.iter_mut().zip(&self.agents) {
            *place = self.world.layout.place(agent.cell) as u32;
        }
    }

    /// Returns whether an action leads an agent to a free cell of the map. Other agents do not matter.
    pub fn is_possible(&self, position: usize, action: Action) -> bool {
        self.world.is_possible(self.places[position], action)
    }

    /// Moves the group and returns its reward.
    pub fn step(&mut self, actions: &[Action]) -> f32 {
        for (position, &action) in actions.iter().enumerate() {
            let place = self.places[position];
            let target = self.world.toward(place, action);
            let waits = action == Action::Stay || self.agents[position].is_done;
            self.targets[position] = if waits { place } else { target };
            self.moves[position] = !waits && self.world.is_free(target);
        }
        withdraw_conflicts(&self.places, &self.targets, &mut self.moves);
        let mut reward = 0.0_f32;
        for (position, &action) in actions.iter().enumerate() {
            if self.moves[position] {
                let (row, col) = self.agents[position].cell.toward(action);
                self.agents[position].cell = Cell::new(row as u16, col as u16);
                self.places[position] = self.targets[position];
            }
            if self.update_goal(position) {
                let share = self.progress_reward / actions.len() as f64;
                reward = (f64::from(reward) + share) as f32;
            }
        }
        reward
    }

    /// Updates an agent's costs and goal after its move; returns whether it is nearer to its goal than ever before.
    fn update_goal(&mut self, position: usize) -> bool {
        let place = self.places[position] as usize;
        let goals = self.goals[position];
        let agent = &mut self.agents[position];
        agent.now = self.grids[position][agent.goal as usize].at(place);
        let progresses = agent.now < agent.best;
        agent.best = agent.best.min(agent.now);
        if agent.cell == goals.list[agent.goal as usize] {
            let next = agent.goal as usize + 1;
            if let Some(&goal) = goals.list.get(next) {
                if next == self.grids[position].len() {
                    self.grids[position].push(self.world.costs_to(goal));
                }
                agent.goal = next as u32;
                agent.now = self.grids[position][next].at(place);
                agent.best = agent.now;
            } else {
                agent.is_done = !goals.repeats_last;
            }
        }
        progresses
    }

    /// Returns the values that determine the network's input for an agent.
    pub fn key(&self, position: usize, radius: usize) -> Key {
        let agent = self.agents[position];
        let mut key =
            Key::new(agent.cell, self.goals[position].list[agent.goal as usize], self.behind(position));
        for other in &self.agents {
            let down = i32::from(other.cell.row) - i32::from(agent.cell.row) + radius as i32;
            let right = i32::from(other.cell.col) - i32::from(agent.cell.col) + radius as i32;
            let side = 2 * radius as i32 + 1;
            if (0..side).contains(&down) && (0..side).contains(&right) {
                key.mark((down * side + right) as usize);
            }
        }
        key
    }

    /// Returns 1 plus the difference between the agent's cost and its smallest cost so far, at most 64.
    fn behind(&self, position: usize) -> u8 {
        let agent = self.agents[position];
        (agent.now - agent.best + 1).min(64) as u8
    }

    /// Writes the network's input for an agent.
    ///
    /// Shape: `[2, side, side]`: 1 for a cell with an agent of the group, then `cost_tracer`.
    pub fn write_input(&self, position: usize, key: &Key, input: &mut [f32]) {
        let agent = self.agents[position];
        let (marks, costs) = input.split_at_mut(input.len() / 2);
        for (index, mark) in marks.iter_mut().enumerate() {
            *mark = f32::from(u8::from(key.is_marked(index)));
        }
        let index = agent.goal as usize;
        let to_goal = ToGoal {
            goal: self.goals[position].list[index],
            grid: self.grids[position][index].clone(),
            now: agent.now,
            best: agent.best,
        };
        let mut window = vec![0; costs.len()];
        write_tracer(self.world.layout, &to_goal, self.places[position] as usize, &mut window, costs);
    }
}
