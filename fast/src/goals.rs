//! The effects of reaching a goal: rewards, ends and next goals.

use pogema_core::{OnGoal, Reward};

use rayon::prelude::*;

use crate::Engine;
use crate::collide::CHUNK;

impl Engine {
    /// Returns which active agents stood on their goals after the reset, or after the last move and before goals
    /// changed.
    pub fn on_goal(&self) -> &[bool] {
        &self.on_goal
    }

    /// Records which active agents are on their goals.
    ///
    /// Rule: goal/finish, goal/nothing, goal/restart
    pub(crate) fn mark_on_goal(&mut self) {
        let (cells, goals, active) = (&self.cells, &self.goals, &self.active);
        let mark = |(first, on_goal): (usize, &mut [bool])| {
            let agents = first..first + on_goal.len();
            let places = cells[agents.clone()].iter().zip(&goals[agents.clone()]).zip(&active[agents]);
            let mut num_on_goal = 0;
            for (on_goal, ((cell, goal), &active)) in on_goal.iter_mut().zip(places) {
                *on_goal = active && cell == goal;
                num_on_goal += usize::from(*on_goal);
            }
            num_on_goal
        };
        self.num_on_goal = match self.pool.as_ref().filter(|_| cells.len() > CHUNK) {
            Some(pool) => pool.install(|| {
                let chunks = self.on_goal.par_chunks_mut(CHUNK).enumerate();
                chunks.map(|(chunk, on_goal)| mark((chunk * CHUNK, on_goal))).sum()
            }),
            None => mark((0, &mut self.on_goal)),
        };
    }

    fn all_on_goal(&self) -> bool {
        self.num_on_goal == self.on_goal.len()
    }

    /// Writes the reward of each agent.
    ///
    /// Rule: reward/own, reward/shared
    pub(crate) fn pay(&self, rewards: &mut [f32]) {
        match (self.config.reward, self.config.on_goal) {
            (Reward::Shared, _) => rewards.fill(self.num_on_goal as f32 / self.on_goal.len() as f32),
            (Reward::Own, OnGoal::Nothing) => rewards.fill(f32::from(u8::from(self.all_on_goal()))),
            (Reward::Own, OnGoal::Finish | OnGoal::Restart) => {
                for (reward, &on_goal) in rewards.iter_mut().zip(&self.on_goal) {
                    *reward = f32::from(u8::from(on_goal));
                }
            }
        }
    }

    /// Writes which agents are terminated.
    ///
    /// Rule: end/terminated
    pub(crate) fn terminate(&self, terminated: &mut [bool]) {
        match self.config.on_goal {
            OnGoal::Finish => {
                for (ended, (cell, goal)) in terminated.iter_mut().zip(self.cells.iter().zip(&self.goals)) {
                    *ended = cell == goal;
                }
            }
            OnGoal::Nothing => terminated.fill(self.all_on_goal()),
            OnGoal::Restart => terminated.fill(false),
        }
    }

    /// Writes which agents are truncated.
    ///
    /// Rule: end/truncated, end/after
    pub(crate) fn truncate(&self, truncated: &mut [bool]) {
        truncated.fill(i64::try_from(self.step).is_ok_and(|step| step >= self.config.max_steps));
    }

    /// Lets the agents on their goals leave the map or get their next goals.
    ///
    /// Rule: goal/finish/leave, goal/nothing, goal/restart/next
    pub(crate) fn change_goals(&mut self) {
        if self.num_on_goal == 0 || self.config.on_goal == OnGoal::Nothing {
            return;
        }
        for agent in 0..self.on_goal.len() {
            if !self.on_goal[agent] {
                continue;
            }
            if self.config.on_goal == OnGoal::Finish {
                self.leave(agent);
            } else {
                self.goals[agent] = self.streams[agent].advance(self.cells[agent]);
            }
        }
    }

    fn leave(&mut self, agent: usize) {
        let (cell, radius) = (self.cells[agent], self.config.radius);
        self.active[agent] = false;
        self.vacate(self.board.place(cell), agent as u32);
        self.occupied.clear(usize::from(cell.row) + radius, usize::from(cell.col) + radius);
    }
}
