//! POGEMA's own procedures for moves.
//!
//! Source: POGEMA 1.4.0, `envs.py`, `Pogema.move_agents` and `Pogema._revert_action`

use std::collections::HashMap;

use pogema_core::Action;

use super::{Literal, Place};

impl Literal {
    fn target(&self, agent: usize, action: Action) -> Place {
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
        let to = self.target(agent, action);
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
            let to = self.target(agent, actions[agent]);
            blocked.entry(to).and_modify(|flag| *flag = true).or_insert(false);
            blocked.insert(self.places[agent], true);
        }
        for agent in self.active_agents() {
            if blocked.get(&self.target(agent, actions[agent])) == Some(&false) {
                self.try_move(agent, actions[agent]);
            }
        }
    }

    /// Moves agents under `soft` in four passes: used cells, swaps, reverts, moves.
    pub(super) fn move_softly(&mut self, actions: &[Action]) {
        let mut actions = actions.to_vec();
        let mut used_cells: HashMap<Place, Vec<usize>> = HashMap::new();
        let mut used_edges: HashMap<(Place, Place), Vec<usize>> = HashMap::new();
        for agent in self.active_agents() {
            let (from, to) = (self.places[agent], self.target(agent, actions[agent]));
            used_cells.entry(to).or_default().push(agent);
            used_edges.insert((from, to), vec![agent]);
            if from != to {
                used_edges.entry((to, from)).or_default().push(agent);
            }
        }
        for agent in self.active_agents() {
            let (from, to) = (self.places[agent], self.target(agent, actions[agent]));
            if used_edges.get(&(from, to)).is_some_and(|users| users.len() > 1) {
                used_cells.entry(to).or_default().retain(|&other| other != agent);
                used_cells.entry(from).or_default().push(agent);
                actions[agent] = Action::Stay;
            }
        }
        for agent in self.active_agents().into_iter().rev() {
            let to = self.target(agent, actions[agent]);
            if used_cells.get(&to).is_some_and(|users| users.len() > 1) || self.obstacles[to.0][to.1] == 1 {
                self.revert(agent, to, &mut used_cells, &mut actions);
            }
        }
        for agent in self.active_agents() {
            self.move_unchecked(agent, self.target(agent, actions[agent]));
        }
    }

    /// Reverts the move of an agent, then that of the agent that was to enter its place, and so on.
    fn revert(
        &self,
        agent: usize,
        to: Place,
        used_cells: &mut HashMap<Place, Vec<usize>>,
        actions: &mut [Action],
    ) {
        let (mut agent, mut to) = (agent, to);
        loop {
            actions[agent] = Action::Stay;
            let users = used_cells.entry(to).or_default();
            if let Some(at) = users.iter().position(|&other| other == agent) {
                users.remove(at);
            }
            let own = self.places[agent];
            let waiting = used_cells.entry(own).or_default();
            waiting.push(agent);
            if waiting.len() == 1 {
                return;
            }
            (agent, to) = (waiting[0], own);
        }
    }
}
