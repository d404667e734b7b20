//! What there is to draw.

use pogema_core::{Config, Map, Snapshot, Trace, TraceStep};

/// An episode to be drawn: a map, and the state after the reset and after each step.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// The rules and sizes.
    pub config: Config,
    /// The map without its border.
    pub map: Map,
    /// The state after the reset.
    pub start: Snapshot,
    /// What each step did.
    pub steps: Vec<TraceStep>,
}

impl Film {
    /// The film of a recorded episode.
    pub fn of(trace: &Trace) -> Self {
        Self {
            config: trace.header.config,
            map: trace.header.map.clone(),
            start: trace.start.state.clone(),
            steps: trace.steps.clone(),
        }
    }

    /// The state after the reset and after each step, one more than there are steps.
    pub fn states(&self) -> impl Iterator<Item = &Snapshot> {
        std::iter::once(&self.start).chain(self.steps.iter().map(|step| &step.state))
    }
}
