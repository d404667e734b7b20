//! Moves as POGEMA makes them.

use std::collections::HashMap;

use pogema_core::Action;

use super::{Literal, Place};

impl Literal {
    fn ahead(&self, agent: usize, action: Action) -> Place {
        let (row, col) = self.places[agent];
        match action {
            Action::Stay => (row, col),
            Action::Up => (row - 1, col),
            Action::Down => (row + 1, col),
            Action::Left => (row, col - 1),
            Action::Right => (row, col + 1),
        }
    }

    fn try_move(&mut self, agent: usize, action: Action) {
        let to = self.ahead(agent, action);
        if self.obstacles[to.0][to.1] == 0 && self.positions[to.0][to.1] == 0 {
            self.move_unchecked(agent, to);
        }
    }

    fn move_unchecked(&mut self, agent: usize, to: Place) {
        let from = self.places[agent];
        self.positions[from.0][from.1] = 0;
        self.positions[to.0][to.1] = 1;
        self.places[agent] = to;
    }

    pub(super) fn active_agents(&self) -> Vec<usize> {
        (0..self.active.len()).filter(|&agent| self.active[agent]).collect()
    }

    pub(super) fn move_by_priority(&mut self, actions: &[Action]) {
        for agent in self.active_agents() {
            self.try_move(agent, actions[agent]);
        }
    }

    pub(super) fn move_blocking_both(&mut self, actions: &[Action]) {
        let mut blocked: HashMap<Place, bool> = HashMap::new();
        for agent in self.active_agents() {
            let to = self.ahead(agent, actions[agent]);
            blocked.entry(to).and_modify(|flag| *flag = true).or_insert(false);
            blocked.insert(self.places[agent], true);
        }
        for agent in self.active_agents() {
            if blocked.get(&self.ahead(agent, actions[agent])) == Some(&false) {
                self.try_move(agent, actions[agent]);
            }
        }
    }

    /// The four passes of `soft`: wishes, swaps, reverts, moves.
    pub(super) fn move_softly(&mut self, actions: &[Action]) {
        let mut actions = actions.to_vec();
        let mut wishes: HashMap<Place, Vec<usize>> = HashMap::new();
        let mut edges: HashMap<(Place, Place), Vec<usize>> = HashMap::new();
        for agent in self.active_agents() {
            let (from, to) = (self.places[agent], self.ahead(agent, actions[agent]));
            wishes.entry(to).or_default().push(agent);
            edges.insert((from, to), vec![agent]);
            if from != to {
                edges.entry((to, from)).or_default().push(agent);
            }
        }
        for agent in self.active_agents() {
            let (from, to) = (self.places[agent], self.ahead(agent, actions[agent]));
            if edges.get(&(from, to)).is_some_and(|users| users.len() > 1) {
                wishes.entry(to).or_default().retain(|&other| other != agent);
                wishes.entry(from).or_default().push(agent);
                actions[agent] = Action::Stay;
            }
        }
        for agent in self.active_agents().into_iter().rev() {
            let to = self.ahead(agent, actions[agent]);
            if wishes.get(&to).is_some_and(|users| users.len() > 1) || self.obstacles[to.0][to.1] == 1 {
                self.revert(agent, to, &mut wishes, &mut actions);
            }
        }
        for agent in self.active_agents() {
            self.move_unchecked(agent, self.ahead(agent, actions[agent]));
        }
    }

    /// Sends an agent back to its own place, and whoever wanted that place back to theirs, and so on.
    fn revert(
        &self,
        agent: usize,
        to: Place,
        wishes: &mut HashMap<Place, Vec<usize>>,
        actions: &mut [Action],
    ) {
        let (mut agent, mut to) = (agent, to);
        loop {
            actions[agent] = Action::Stay;
            let users = wishes.entry(to).or_default();
            if let Some(at) = users.iter().position(|&other| other == agent) {
                users.remove(at);
            }
            let own = self.places[agent];
            let waiting = wishes.entry(own).or_default();
            waiting.push(agent);
            if waiting.len() == 1 {
                return;
            }
            (agent, to) = (waiting[0], own);
        }
    }
}
