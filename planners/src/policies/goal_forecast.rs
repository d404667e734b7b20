//! Future goals, for planners that use them.

use std::collections::VecDeque;

use pogema_core::{Cell, Error, GoalStream, Instance, State};

/// The future goals of all agents, read from their instance and advanced with the episode.
///
/// Only a policy whose paper provides future goals should use it, because an environment does not reveal them.
#[derive(Debug)]
pub struct GoalForecast {
    streams: Vec<GoalStream>,
    /// For each agent, its current goal and later ones.
    ahead: Vec<VecDeque<Cell>>,
    /// The step of the next state.
    step: u64,
}

impl GoalForecast {
    /// Creates the forecast at the start of an episode, with `num_goals` goals of each agent (at least 1), including
    /// the current one.
    pub fn new(instance: &Instance, num_goals: usize) -> Self {
        let mut streams = instance.goals().to_vec();
        let ahead = streams.iter_mut().map(|stream| {
            let mut goals = VecDeque::from([stream.first()]);
            while goals.len() < num_goals {
                draw(stream, &mut goals);
            }
            goals
        });
        Self { ahead: ahead.collect(), streams, step: 0 }
    }

    /// Advances to the next state. After an error, the forecast is unchanged.
    ///
    /// # Errors
    /// [`Error::OutOfStep`] for a state that is not the next one, or for goals of another episode; [`Error::Length`]
    /// unless the state holds for each agent a goal and whether the agent is on it.
    pub fn follow(&mut self, now: State<'_>) -> Result<(), Error> {
        now.check_next(self.step, self.ahead.len())?;
        Error::check_length("goals", self.ahead.len(), now.goals.len())?;
        Error::check_length("on_goal", self.ahead.len(), now.on_goal.len())?;
        let has_reached = |agent: usize| now.step > 0 && now.on_goal[agent];
        for (agent, (goals, stream)) in self.ahead.iter().zip(&self.streams).enumerate() {
            let expected = match (has_reached(agent), goals.get(1)) {
                (false, _) => goals[0],
                (true, Some(&next)) => next,
                (true, None) => stream.clone().advance(goals[0]),
            };
            if expected != now.goals[agent] {
                let found = now.goals[agent];
                let reason = format!(
                    "goal {found} of agent {agent} does not match its future goals, expected {expected}"
                );
                return Err(Error::OutOfStep { reason });
            }
        }
        self.step += 1;
        for (agent, goals) in self.ahead.iter_mut().enumerate() {
            if has_reached(agent) {
                draw(&mut self.streams[agent], goals);
                goals.pop_front();
                goals.make_contiguous();
            }
        }
        Ok(())
    }

    /// Returns the goals of an agent, the current one first.
    pub fn goals(&self, agent: usize) -> &[Cell] {
        // INVARIANT: `follow` leaves all goals in one slice, and so does `new`.
        self.ahead[agent].as_slices().0
    }
}

/// Appends the goal after the last one.
fn draw(stream: &mut GoalStream, goals: &mut VecDeque<Cell>) {
    if let Some(&last) = goals.back() {
        goals.push_back(stream.advance(last));
    }
}
