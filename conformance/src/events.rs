//! How often the interesting things happened: a run that met none of them proves little.

use pogema_core::{Action, Cell, Snapshot};
use serde::Serialize;

use crate::request::{Record, Response};

/// Defines counters, each with its name in reports.
macro_rules! counters {
    ($($(#[$attribute:meta])* $field:ident = $name:literal,)+) => {
        /// Counts of what happened in the episodes that were compared.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
        pub struct Events {
            $($(#[$attribute])* pub $field: u64,)+
        }

        impl Events {
            /// The counts by name.
            pub fn named(&self) -> impl Iterator<Item = (&'static str, u64)> {
                [$(($name, self.$field)),+].into_iter()
            }

            /// Adds other counts.
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
    /// Pairs of agents that wanted each other's cells.
    swaps = "swaps",
    /// Cells that two or more agents wanted.
    contests = "contests",
    /// Agents that entered a cell another agent left in the same step.
    chains = "chains",
    /// Rings of three or more agents that moved all at once.
    cycles = "cycles",
    /// Agents that stayed because the agent ahead wanted to move and could not.
    cascades = "cascades",
    /// Active agents that the occupancy grid does not show.
    vanished = "vanished",
    /// Agents that left the map on their goals.
    finished = "finished",
    /// Goals that were replaced by others.
    new_goals = "new goals",
}

impl Events {
    /// Counts what happened in a response.
    pub fn watch(&mut self, response: &Response) {
        let mut before: Option<&Snapshot> = None;
        for record in &response.records {
            if let (Some(before), Some(step)) = (before, record.step()) {
                self.watch_step(before, &step.step.actions, &step.step.state);
            }
            self.episodes += u64::from(matches!(record, Record::Reset(_)));
            before = record.state().or(before);
        }
    }

    fn watch_step(&mut self, before: &Snapshot, actions: &[Action], after: &Snapshot) {
        let step = Step::new(before, actions, after);
        self.steps += 1;
        for (index, &agent) in step.agents.iter().enumerate() {
            let ahead = step.occupant(step.targets[agent]);
            let wants_to_move = |agent: usize| actions[agent] != Action::Stay;
            if let Some(ahead) = ahead.filter(|&ahead| ahead != agent) {
                self.swaps += u64::from(ahead > agent && step.targets[ahead] == step.place(agent));
                self.chains += u64::from(step.moved(agent));
                self.cascades += u64::from(!step.moved(agent) && wants_to_move(ahead) && !step.moved(ahead));
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

    /// Whether the agent is the lowest index of a ring of moves.
    fn leads_cycle(&self, agent: usize) -> bool {
        let cell_of = |cell: Cell| self.occupant(cell.toward(Action::Stay));
        let mut at = agent;
        loop {
            if !self.moved(at) {
                return false;
            }
            match cell_of(self.after.cells[at]) {
                Some(next) if next == agent => return true,
                Some(next) if next > agent => at = next,
                _ => return false,
            }
        }
    }
}
