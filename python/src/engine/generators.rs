//! The generators from which the next goals are drawn.

use pogema_core::{Error, GoalStream, StreamState};

use super::Inner;

impl Inner {
    /// Returns the state of each agent's generator of goals, or `None` if goals are not drawn.
    pub(super) fn goal_generators(&self) -> Result<Option<Vec<String>>, Error> {
        let states = self.episode.engine().streams().iter().map(GoalStream::save);
        let states = states.collect::<Result<Vec<_>, _>>()?.into_iter();
        let drawn = states.map(|state| match state {
            StreamState::Drawn(state) => Some(state),
            StreamState::Same | StreamState::Sequence(_) => None,
        });
        Ok(drawn.collect())
    }

    /// Sets the state of each agent's generator of goals.
    ///
    /// # Errors
    /// If goals are not drawn, or a text is not a state. No generator is changed then.
    pub(super) fn set_goal_generators(&mut self, states: Vec<String>) -> Result<(), Error> {
        let mut streams = self.episode.engine().streams().to_vec();
        Error::check_length("goal generators", streams.len(), states.len())?;
        for (stream, state) in streams.iter_mut().zip(states) {
            stream.restore(&StreamState::Drawn(state))?;
        }
        self.episode.engine_mut().set_streams(streams)
    }
}
