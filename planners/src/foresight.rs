//! The goals that are still to come, for planners that may know them.

use std::collections::VecDeque;

use pogema_core::{Cell, Error, GoalStream, Instance, State};

/// What agents will want, told from their instance and kept in step with the episode.
#[derive(Debug)]
pub(crate) struct Foresight {
    streams: Vec<GoalStream>,
    /// For each agent, its present goal and those after it.
    ahead: Vec<VecDeque<Cell>>,
    /// The step of the episode that is told next.
    step: u64,
}

impl Foresight {
    /// Goals of an agent that are known, the present one included.
    const REACH: usize = 24;

    /// The goals with which an episode begins.
    pub fn new(instance: &Instance) -> Self {
        let mut streams = instance.goals().to_vec();
        let ahead = streams.iter_mut().map(|stream| {
            let mut goals = VecDeque::from([stream.first()]);
            while goals.len() < Self::REACH {
                draw(stream, &mut goals);
            }
            goals
        });
        Self { ahead: ahead.collect(), streams, step: 0 }
    }

    /// Moves on by one step.
    ///
    /// # Errors
    /// [`Error::State`] for another step than the next one, or for goals of another episode.
    pub fn follow(&mut self, now: State<'_>) -> Result<(), Error> {
        let strange = |reason: String| Error::State { reason };
        if now.step != self.step || now.goals.len() != self.ahead.len() {
            let reason = format!("the goals to come are known for step {}, not for {}", self.step, now.step);
            return Err(strange(reason));
        }
        self.step += 1;
        for (agent, goals) in self.ahead.iter_mut().enumerate() {
            if now.step > 0 && now.on_goal[agent] {
                goals.pop_front();
                draw(&mut self.streams[agent], goals);
            }
            if goals.front() != Some(&now.goals[agent]) {
                return Err(strange(format!("goal {} of agent {agent} was not to come", now.goals[agent])));
            }
        }
        Ok(())
    }

    /// The goals of an agent, the present one first.
    pub fn goals(&mut self, agent: usize) -> &[Cell] {
        self.ahead[agent].make_contiguous()
    }
}

/// Adds the goal that follows the last one.
fn draw(stream: &mut GoalStream, goals: &mut VecDeque<Cell>) {
    if let Some(&last) = goals.back() {
        goals.push_back(stream.advance(last));
    }
}
