//! Counts of the relevant events in random plans: a run without them would prove little.

use pogema_conformance::{Back, Events, Record, Response, StepRecord};
use pogema_core::{Action, Snapshot, StepResults, TraceStep};

/// Counts of events in the compared steps.
#[derive(Clone, Copy, Debug, Default)]
pub struct EventCounts {
    pub events: Events,
    /// Agents that followed an agent that itself followed another one.
    pub long_chains: u64,
}

impl EventCounts {
    /// Counts the events of a step.
    pub fn watch(&mut self, before: Snapshot, actions: Vec<Action>, after: Snapshot, results: StepResults) {
        self.long_chains += num_in_long_chains(&before, &after);
        let StepResults { rewards, terminated, truncated } = results;
        let step = TraceStep {
            actions,
            state: after,
            rewards,
            terminated,
            truncated,
            observations: None,
            metrics: None,
        };
        let step = StepRecord { step, actions_after: Vec::new(), infos_active: Vec::new() };
        let records = vec![Record::Back(Back { moved: true, state: before }), Record::Step(Box::new(step))];
        self.events.watch(&Response { records, ..Response::default() });
    }

    /// Returns each count with its name and the minimum that 2000 plans must reach.
    pub fn with_minimums(&self) -> [(&'static str, u64, u64); 9] {
        let events = &self.events;
        [
            ("swaps", events.swaps, 1000),
            ("contests", events.contests, 2000),
            ("chains", events.chains, 1000),
            ("long chains", self.long_chains, 500),
            ("cycles", events.cycles, 100),
            ("cascades", events.cascades, 2000),
            ("vanished agents", events.vanished, 300),
            ("finished agents", events.finished, 300),
            ("new goals", events.new_goals, 150),
        ]
    }
}

fn num_in_long_chains(before: &Snapshot, after: &Snapshot) -> u64 {
    let moved = |&agent: &usize| before.cells[agent] != after.cells[agent];
    let movers: Vec<usize> = (0..before.cells.len()).filter(moved).collect();
    let ahead =
        |agent: usize| movers.iter().copied().find(|&other| before.cells[other] == after.cells[agent]);
    movers.iter().filter(|&&agent| ahead(agent).and_then(ahead).is_some()).count() as u64
}
