//! The collision system `soft`, with the bugs planted in it.

use std::collections::HashMap;

use pogema_core::Action;

use crate::engine::{Flawed, Place};
use crate::flaw::Flaw;

impl Flawed {
    pub fn move_softly(&mut self, actions: &[Action]) {
        let agents = self.active_agents();
        let at: HashMap<Place, usize> = agents.iter().map(|&agent| (self.cells[agent], agent)).collect();
        let targets: HashMap<usize, Place> =
            agents.iter().map(|&agent| (agent, self.target(agent, actions))).collect();
        let blocked = |agent: usize| self.is_blocked(targets[&agent]);
        let mut moves: HashMap<usize, bool> = agents
            .iter()
            .map(|&agent| {
                let target = targets[&agent];
                let ahead = at.get(&target).copied();
                let swaps = ahead.is_some_and(|other| other != agent && targets[&other] == self.cells[agent]);
                let waits = target == self.cells[agent];
                let follows = ahead.is_some_and(|other| other != agent);
                let stays = waits
                    || swaps && self.flaw != Flaw::SoftSwaps
                    || blocked(agent) && self.flaw != Flaw::SoftObstaclesLast
                    || follows && self.flaw == Flaw::SoftNobodyFollows
                    || self.flaw == Flaw::SoftNoRotation && rotates(agent, &at, &targets)
                    || self.is_held_by_finished(target);
                (agent, !stays)
            })
            .collect();
        let mut num_passes = 0;
        loop {
            let hindered: Vec<usize> = agents
                .iter()
                .copied()
                .filter(|&agent| self.is_hindered(agent, &moves, &at, &targets))
                .collect();
            num_passes += 1;
            let most_passes = match self.flaw {
                Flaw::SoftOnlyDirectConflicts => 1,
                Flaw::SoftChainStopsAfterOne => 2,
                _ => usize::MAX,
            };
            if hindered.is_empty() || num_passes > most_passes {
                break;
            }
            for agent in hindered {
                moves.insert(agent, false);
            }
        }
        for agent in agents {
            let goes = moves[&agent] && !self.is_blocked(targets[&agent]);
            let target = if goes { targets[&agent] } else { self.cells[agent] };
            self.put(agent, target);
        }
        if self.flaw == Flaw::SoftMarksNobodyLoses {
            self.mark_all();
        }
    }

    fn is_held_by_finished(&self, target: Place) -> bool {
        let is_there = |agent: usize| !self.active[agent] && self.cells[agent] == target;
        self.flaw == Flaw::FinishedStillBlock && (0..self.cells.len()).any(is_there)
    }

    /// Whether a moving agent cannot, given who else moves.
    fn is_hindered(
        &self,
        agent: usize,
        moves: &HashMap<usize, bool>,
        at: &HashMap<Place, usize>,
        targets: &HashMap<usize, Place>,
    ) -> bool {
        if !moves[&agent] {
            return false;
        }
        let target = targets[&agent];
        let stays = at.get(&target).is_some_and(|ahead| {
            let waits = targets[ahead] == target && self.flaw == Flaw::SoftWaitClaimsNothing;
            !moves[ahead] && !waits
        });
        let rivals =
            moves.iter().filter(|(other, moves)| **moves && **other != agent && targets[*other] == target);
        let mut others = rivals.map(|(&other, _)| other);
        let loses = match self.flaw {
            Flaw::SoftAllContendersStay => others.next().is_some(),
            Flaw::SoftHighestWins => others.any(|other| other > agent),
            _ => others.any(|other| other < agent),
        };
        stays || loses
    }
}

/// Whether an agent is part of a ring in which everybody wants the next one's cell.
fn rotates(agent: usize, at: &HashMap<Place, usize>, targets: &HashMap<usize, Place>) -> bool {
    let mut ahead = agent;
    for _ in 0..at.len() {
        match at.get(&targets[&ahead]) {
            Some(&next) if next == agent => return true,
            Some(&next) => ahead = next,
            None => return false,
        }
    }
    false
}
