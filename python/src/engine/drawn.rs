//! Tracks which goals POGEMA stores as NumPy integers, because users see the type.

use std::ffi::CString;

use pogema_core::{OnGoal, Snapshot};
use pogema_maps::Targets;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use super::Inner;

/// Flags that mark goals drawn since the reset: for the current goals and, in persistent mode, for the goals at each
/// kept change.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drawn {
    now: Vec<bool>,
    kept: Vec<Vec<bool>>,
}

impl Drawn {
    /// Begins an episode.
    pub fn begin(&mut self, num_agents: usize, is_kept: bool) {
        self.now = vec![false; num_agents];
        self.kept = if is_kept { vec![vec![false]; num_agents] } else { Vec::new() };
    }

    /// Returns whether the flags match the number of agents, and hold changes exactly if changes are kept.
    pub fn fits(&self, num_agents: usize, is_kept: bool) -> bool {
        self.now.len() == num_agents && self.kept.len() == if is_kept { num_agents } else { 0 }
    }

    /// Returns for each agent whether its current goal was drawn.
    pub fn now(&self) -> &[bool] {
        &self.now
    }

    /// Returns for each kept change of an agent whether its goal was drawn.
    pub fn kept(&self, agent: usize) -> &[bool] {
        self.kept.get(agent).map_or(&[], |kept| kept)
    }

    /// Marks the new goals of agents as drawn.
    pub fn note(&mut self, got_new: &[bool]) {
        for (is_drawn, &is_new) in self.now.iter_mut().zip(got_new) {
            *is_drawn |= is_new;
        }
    }

    /// Keeps the flag of each agent whose state the last step changed.
    pub fn remember(&mut self, past: &[Snapshot]) {
        for (agent, (kept, &now)) in self.kept.iter_mut().zip(&self.now).enumerate() {
            if has_changed(past, agent) {
                kept.push(now);
            }
        }
    }

    /// Takes the last step back; `past` still has to contain it.
    pub fn take_back(&mut self, past: &[Snapshot]) {
        for (agent, (kept, now)) in self.kept.iter_mut().zip(&mut self.now).enumerate() {
            if has_changed(past, agent) {
                kept.pop();
                *now = kept.last().copied().unwrap_or(false);
            }
        }
    }
}

fn has_changed(past: &[Snapshot], agent: usize) -> bool {
    let [.., before, after] = past else { return false };
    let state = |snapshot: &Snapshot| (snapshot.cells[agent], snapshot.goals[agent], snapshot.active[agent]);
    state(before) != state(after)
}

impl Inner {
    /// Records which goals are new. In POGEMA drawn goals are NumPy integers and given goals are not.
    pub(super) fn note_goals(&mut self) {
        let config = self.source.config();
        let is_lifelong = config.on_target == OnGoal::Restart;
        let has_sequences = matches!(config.targets_xy, Some(Targets::Sequences(_)));
        if is_lifelong && !has_sequences {
            self.drawn.note(self.episode.state().on_goal);
        }
        if config.persistent {
            self.drawn.remember(self.episode.past());
        }
    }

    /// Warns about goal sequences that have just wrapped around to their first goals.
    ///
    /// The step is complete even if Python turns a warning into an error.
    ///
    /// Rule: goal/restart/sequence
    pub(super) fn warn_of_wraps(&self, py: Python<'_>) -> PyResult<()> {
        if self.source.config().on_target != OnGoal::Restart {
            return Ok(());
        }
        let (streams, on_goal) = (self.episode.engine().streams(), self.episode.state().on_goal);
        for (agent, stream) in streams.iter().enumerate().filter(|(agent, _)| on_goal[*agent]) {
            if let Some((num_goals, 0)) = stream.sequence_position() {
                let text = format!(
                    "agent {agent} has reached all {num_goals} goals of its sequence, which wraps around to the \
                     first one; an episode has {} steps, so give the agent more goals",
                    self.time_limit
                );
                let category = py.get_type::<PyUserWarning>();
                PyErr::warn(py, &category, &CString::new(text).unwrap_or_default(), 2)?;
            }
        }
        Ok(())
    }
}
