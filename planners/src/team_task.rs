//! The path-finding task of a whole team, for searches that plan one agent at a time.

use crate::distances::CostToGo;
use crate::graph::Vertex;
use crate::problem::Problem;
use crate::reservations::Reservations;
use crate::sipp::{Horizon, Leg, Order, Task};

/// Starts, goals and horizon of all agents.
pub(crate) struct TeamTask<'a> {
    pub(crate) starts: &'a [Vertex],
    pub(crate) legs: &'a [Vec<Leg>],
    pub(crate) horizon: Horizon,
    pub(crate) salt: u32,
}

impl<'a> TeamTask<'a> {
    /// Creates the task of a one-shot problem.
    pub(crate) fn one_shot(problem: &'a Problem, legs: &'a [Vec<Leg>], seed: u64) -> Self {
        let horizon = Horizon::Stay { max_steps: problem.last_step() };
        Self { starts: &problem.starts, legs, horizon, salt: seed as u32 }
    }

    /// Creates the task of one agent, without soft constraints or forbidden moves.
    pub(crate) fn task<'t>(&'t self, agent: usize, reserved: &'t Reservations) -> Task<'t> {
        Task {
            start: self.starts[agent],
            legs: &self.legs[agent],
            reserved,
            avoided: None,
            banned: &[],
            horizon: self.horizon,
            order: Order::Cost,
            salt: self.salt,
        }
    }

    /// Returns whether agents stay at the ends of their paths.
    pub(crate) fn stays(&self) -> bool {
        matches!(self.horizon, Horizon::Stay { .. })
    }
}

/// Makes one leg for each agent of a one-shot problem.
pub(crate) fn one_leg_each(costs: &[CostToGo]) -> Vec<Vec<Leg>> {
    costs.iter().map(|to_go| vec![Leg::last(to_go.clone())]).collect()
}
