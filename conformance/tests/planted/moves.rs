//! The collision systems `priority` and `block_both`, with the bugs planted in them.

use std::collections::{HashMap, HashSet};

use pogema_core::{Action, Collision};

use crate::engine::{Flawed, Place};
use crate::flaw::Flaw;

impl Flawed {
    pub fn move_agents(&mut self, actions: &[Action]) {
        match self.config.collision {
            Collision::Priority => self.move_by_priority(actions),
            Collision::BlockBoth => self.move_blocking_both(actions),
            Collision::Soft => self.move_softly(actions),
        }
    }

    fn move_by_priority(&mut self, actions: &[Action]) {
        let mut order = self.active_agents();
        if self.has(Flaw::PriorityHighestFirst) {
            order.reverse();
        }
        let before = self.occupied.clone();
        for agent in order {
            let target = self.target(agent, actions);
            let was_taken = self.has(Flaw::PriorityNobodyFollows) && before.contains(&target);
            if !self.is_blocked(target) && !self.is_taken(target) && !was_taken {
                self.put(agent, target);
            }
        }
    }

    /// Whether a cell is marked by somebody who blocks it.
    fn is_taken(&self, target: Place) -> bool {
        let is_finished = |agent: usize| !self.active[agent] && self.cells[agent] == target;
        let only_seen = self.has(Flaw::FinishedAreSeen) && (0..self.cells.len()).any(is_finished);
        let stands = |agent: usize| self.active[agent] && self.cells[agent] == target;
        let holds = (0..self.cells.len()).any(stands);
        self.occupied.contains(&target) && (holds || !only_seen)
    }

    fn move_blocking_both(&mut self, actions: &[Action]) {
        let targets: HashMap<usize, Place> =
            self.active_agents().into_iter().map(|agent| (agent, self.target(agent, actions))).collect();
        let taken: HashSet<Place> = self.occupied.iter().copied().filter(|&at| self.is_taken(at)).collect();
        let is_left =
            |at: Place| targets.iter().any(|(&other, &target)| self.cells[other] == at && target != at);
        let may_move = |agent: &usize| {
            let target = targets[agent];
            let mut wanting: Vec<usize> =
                targets.iter().filter(|(_, other)| **other == target).map(|(&other, _)| other).collect();
            wanting.sort_unstable();
            let alone =
                wanting.len() == 1 || self.has(Flaw::BlockBothLowestEnters) && wanting.first() == Some(agent);
            let free = !taken.contains(&target) || self.has(Flaw::BlockBothFollows) && is_left(target);
            alone && free && !self.is_blocked(target)
        };
        let moving: Vec<usize> = self.active_agents().into_iter().filter(may_move).collect();
        for agent in moving {
            self.put(agent, targets[&agent]);
        }
    }
}
