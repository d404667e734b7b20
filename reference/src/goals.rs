//! The effects of reaching a goal: rewards, ends and next goals.

use pogema_core::{OnGoal, Reward};

use crate::Reference;
use crate::grid::place;

impl Reference {
    /// Records which active agents are on their goals.
    ///
    /// Rule: goal/finish, goal/nothing, goal/restart
    pub(crate) fn mark_on_goal(&mut self) {
        let reached = |agent: usize| self.active[agent] && self.cells[agent] == self.goals[agent];
        self.on_goal = (0..self.cells.len()).map(reached).collect();
    }

    fn all_on_goal(&self) -> bool {
        self.on_goal.iter().all(|&reached| reached)
    }

    /// Writes the reward of each agent.
    ///
    /// Rule: reward/own, reward/shared
    pub(crate) fn pay(&self, rewards: &mut [f32]) {
        let num_reached = self.on_goal.iter().filter(|&&reached| reached).count();
        let shared = num_reached as f32 / self.on_goal.len() as f32;
        for (reward, &reached) in rewards.iter_mut().zip(&self.on_goal) {
            *reward = match (self.config.reward, self.config.on_goal) {
                (Reward::Shared, _) => shared,
                (Reward::Own, OnGoal::Nothing) => f32::from(u8::from(self.all_on_goal())),
                (Reward::Own, OnGoal::Finish | OnGoal::Restart) => f32::from(u8::from(reached)),
            };
        }
    }

    /// Writes which agents are terminated.
    ///
    /// Rule: end/terminated
    pub(crate) fn terminate(&self, terminated: &mut [bool]) {
        for (agent, ended) in terminated.iter_mut().enumerate() {
            *ended = match self.config.on_goal {
                // A finished agent stays on its goal, so it stays terminated.
                OnGoal::Finish => self.cells[agent] == self.goals[agent],
                OnGoal::Nothing => self.all_on_goal(),
                OnGoal::Restart => false,
            };
        }
    }

    /// Writes which agents are truncated.
    ///
    /// Rule: end/truncated, end/after
    ///
    /// Source: POGEMA 1.4.0, `wrappers/multi_time_limit.py`, `MultiTimeLimit.step`
    pub(crate) fn truncate(&self, truncated: &mut [bool]) {
        truncated.fill(i64::try_from(self.step).is_ok_and(|step| step >= self.config.max_steps));
    }

    /// Lets the agents on their goals leave the map or get their next goals.
    ///
    /// Rule: goal/finish/leave, goal/nothing, goal/restart/next
    pub(crate) fn change_goals(&mut self) {
        let reached: Vec<usize> = (0..self.cells.len()).filter(|&agent| self.on_goal[agent]).collect();
        for agent in reached {
            match self.config.on_goal {
                OnGoal::Finish => self.leave(agent),
                OnGoal::Nothing => {}
                OnGoal::Restart => self.goals[agent] = self.streams[agent].advance(self.cells[agent]),
            }
        }
    }

    fn leave(&mut self, agent: usize) {
        self.active[agent] = false;
        self.occupied.set(place(self.cells[agent]), false);
    }
}
