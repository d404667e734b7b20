//! Counts of conflicts and other events, which show how much of the rules a run tested.

use pogema_core::{Action, Cell, Snapshot};
use serde::Serialize;

use crate::request::{Record, Response};

/// Defines counters and their names in reports.
macro_rules! counters {
    ($($(#[$attribute:meta])* $field:ident = $name:literal,)+) => {
        /// Counts of events in the compared episodes.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
        pub struct Events {
            $($(#[$attribute])* pub $field: u64,)+
        }

        impl Events {
            /// Returns the counts with their names.
            pub fn named(&self) -> impl Iterator<Item = (&'static str, u64)> {
                [$(($name, self.$field)),+].into_iter()
            }

            /// Adds the counts of other episodes.
            pub fn add(&mut self, other: &Self) {
                $(self.$field += other.$field;)+
            }
        }
    };
}

counters! {
    /// Episodes.
    episodes = "episodes",
    /// Steps.
    steps = "steps",
    /// Pairs of agents that tried to swap cells.
    swaps = "swaps",
    /// Cells that two or more agents chose as their next cell; an agent that stays chooses its own.
    contests = "contests",
    /// Agents that entered a cell that another agent left in the same step.
    chains = "chains",
    /// Rings of three or more agents that moved in the same step.
    cycles = "cycles",
    /// Agents that aimed at the cell of another agent that also tried to move, when neither moved.
    cascades = "cascades",
    /// Active agents without a mark in the occupancy grid.
    vanished = "vanished",
    /// Agents that finished on their goals and left the map.
    finished = "finished",
    /// Goals that were replaced by new ones.
    new_goals = "new goals",
}

impl Events {
    /// Adds the events of a response to the counts.
    pub fn watch(&mut self, response: &Response) {
        let mut before: Option<&Snapshot> = None;
        for record in &response.records {
            if let (Some(before), Some(step)) = (before, record.step()) {
                self.count_step(before, &step.step.actions, &step.step.state);
            }
            self.episodes += u64::from(matches!(record, Record::Reset(_)));
            before = record.state().or(before);
        }
    }

    fn count_step(&mut self, before: &Snapshot, actions: &[Action], after: &Snapshot) {
        let step = Step::new(before, actions, after);
        self.steps += 1;
        for (index, &agent) in step.agents.iter().enumerate() {
            let ahead = step.occupant(step.targets[agent]);
            let requests_move = |agent: usize| actions[agent] != Action::Stay;
            if let Some(ahead) = ahead.filter(|&ahead| ahead != agent) {
                self.swaps += u64::from(ahead > agent && step.targets[ahead] == step.place(agent));
                self.chains += u64::from(step.moved(agent));
                self.cascades += u64::from(!step.moved(agent) && requests_move(ahead) && !step.moved(ahead));
            }
            let same = |&other: &usize| step.targets[other] == step.targets[agent];
            let is_first = !step.agents[..index].iter().any(same);
            self.contests += u64::from(is_first && step.agents[index + 1..].iter().any(same));
            self.cycles += u64::from(step.leads_cycle(agent));
        }
        for agent in 0..actions.len() {
            self.vanished += u64::from(after.active[agent] && !after.occupied.contains(&after.cells[agent]));
            self.finished += u64::from(before.active[agent] && !after.active[agent]);
            self.new_goals += u64::from(before.goals[agent] != after.goals[agent]);
        }
    }
}

struct Step<'a> {
    before: &'a Snapshot,
    after: &'a Snapshot,
    agents: Vec<usize>,
    targets: Vec<(i32, i32)>,
}

impl<'a> Step<'a> {
    fn new(before: &'a Snapshot, actions: &[Action], after: &'a Snapshot) -> Self {
        let agents = (0..actions.len()).filter(|&agent| before.active[agent]).collect();
        let targets = before.cells.iter().zip(actions).map(|(cell, &action)| cell.toward(action)).collect();
        Self { before, after, agents, targets }
    }

    fn place(&self, agent: usize) -> (i32, i32) {
        self.before.cells[agent].toward(Action::Stay)
    }

    fn moved(&self, agent: usize) -> bool {
        self.before.cells[agent] != self.after.cells[agent]
    }

    fn occupant(&self, place: (i32, i32)) -> Option<usize> {
        self.agents.iter().copied().find(|&agent| self.place(agent) == place)
    }

    /// Returns whether the agent has the lowest index of a ring of moves.
    fn leads_cycle(&self, agent: usize) -> bool {
        let occupant_of = |cell: Cell| self.occupant(cell.toward(Action::Stay));
        let mut at = agent;
        loop {
            if !self.moved(at) {
                return false;
            }
            match occupant_of(self.after.cells[at]) {
                Some(next) if next == agent => return true,
                Some(next) if next > agent => at = next,
                _ => return false,
            }
        }
    }
}
