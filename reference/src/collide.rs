//! Conflicting moves under the three collision systems.

use std::collections::HashMap;

use pogema_core::{Action, Cell, Collision, Occupancy};

use crate::Reference;
use crate::grid::place;

/// The active agents by their cell before the step.
type Occupants = HashMap<(i32, i32), usize>;

impl Reference {
    /// Moves the active agents by their actions, as far as the collision system allows.
    ///
    /// Rule: move/actions, move/inactive
    ///
    /// Source: POGEMA 1.4.0, `envs.py`, `Pogema.move_agents`
    pub(crate) fn move_agents(&mut self, actions: &[Action]) {
        match self.config.collision {
            Collision::Priority => self.move_by_priority(actions),
            Collision::BlockBoth => self.move_blocking_both(actions),
            Collision::Soft => self.move_softly(actions),
        }
        if self.config.occupancy == Occupancy::Exact {
            self.occupy_exactly();
        }
    }

    /// Moves the agents one by one, lowest index first. Each moves if its target is free and
    /// unoccupied at that moment.
    ///
    /// Rule: collide/priority, collide/priority/contest, collide/priority/follow, collide/priority/swap
    fn move_by_priority(&mut self, actions: &[Action]) {
        for agent in self.active_agents() {
            let target = self.target(agent, actions);
            if !self.obstacles.get(target) && !self.occupied.get(target) {
                self.put(agent, target);
            }
        }
    }

    /// Moves agents onto cells that were unoccupied before the step and that no other agent aims at.
    ///
    /// Rule: collide/block-both, collide/block-both/contest, collide/block-both/occupied
    fn move_blocking_both(&mut self, actions: &[Action]) {
        let occupied_before = self.occupied.clone();
        let mut num_contenders: HashMap<_, usize> = HashMap::new();
        for agent in self.active_agents() {
            *num_contenders.entry(self.target(agent, actions)).or_default() += 1;
        }
        for agent in self.active_agents() {
            let target = self.target(agent, actions);
            if !self.obstacles.get(target) && !occupied_before.get(target) && num_contenders[&target] == 1 {
                self.put(agent, target);
            }
        }
    }

    /// Moves all agents simultaneously, and reverts only impossible moves.
    ///
    /// Rule: collide/soft, occupancy/as-released
    fn move_softly(&mut self, actions: &[Action]) {
        let occupants: HashMap<_, _> =
            self.active_agents().into_iter().map(|agent| (place(self.cells[agent]), agent)).collect();
        let mut moves = self.moves_possible_alone(actions, &occupants);
        loop {
            let hindered = self.find_hindered(&moves, actions, &occupants);
            if hindered.is_empty() {
                break;
            }
            for agent in hindered {
                moves[agent] = false;
            }
        }
        for agent in self.active_agents() {
            let target = if moves[agent] { self.target(agent, actions) } else { place(self.cells[agent]) };
            self.put(agent, target);
        }
    }

    /// Returns which agents move if no other move fails: all except those that wait, move into an obstacle or swap.
    ///
    /// Rule: collide/soft/stay, collide/soft/swap
    fn moves_possible_alone(&self, actions: &[Action], occupants: &Occupants) -> Vec<bool> {
        let mut moves = vec![false; self.cells.len()];
        for agent in self.active_agents() {
            let target = self.target(agent, actions);
            let swaps = occupants
                .get(&target)
                .is_some_and(|&other| self.target(other, actions) == place(self.cells[agent]));
            // A waiting agent counts as swapping with itself.
            moves[agent] = !self.obstacles.get(target) && !swaps;
        }
        moves
    }

    /// Returns the moving agents whose target stays occupied or goes to an agent with a lower index.
    ///
    /// Rule: collide/soft/contest, collide/soft/chain
    fn find_hindered(&self, moves: &[bool], actions: &[Action], occupants: &Occupants) -> Vec<usize> {
        let mut winners = HashMap::new();
        let mut hindered = Vec::new();
        for agent in self.active_agents().into_iter().filter(|&agent| moves[agent]) {
            let target = self.target(agent, actions);
            let occupant_stays = occupants.get(&target).is_some_and(|&occupant| !moves[occupant]);
            let wins = *winners.entry(target).or_insert(agent) == agent;
            if occupant_stays || !wins {
                hindered.push(agent);
            }
        }
        hindered
    }

    /// Returns the cell that an agent's action leads to.
    fn target(&self, agent: usize, actions: &[Action]) -> (i32, i32) {
        self.cells[agent].toward(actions[agent])
    }

    /// Moves one agent and its mark.
    ///
    /// If an agent with a lower index has already entered the cell that this agent leaves, the mark of that other agent
    /// is erased. Under `soft`, agents vanish this way.
    ///
    /// Rule: occupancy/as-released
    fn put(&mut self, agent: usize, target: (i32, i32)) {
        self.occupied.set(place(self.cells[agent]), false);
        self.occupied.set(target, true);
        self.cells[agent] = Cell::new(target.0 as u16, target.1 as u16);
    }

    /// Marks the cell of every active agent.
    ///
    /// Rule: occupancy/exact
    fn occupy_exactly(&mut self) {
        for agent in self.active_agents() {
            self.occupied.set(place(self.cells[agent]), true);
        }
    }
}
