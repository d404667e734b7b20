//! Who may move: the three collision systems.
//!
//! The reference says what each system means. Here every agent first names the square it aims at; then each
//! square decides by itself, through a claim that the lowest index wins, so that the order of the agents does not
//! matter and the work can be shared among threads. Only `priority` is an order by definition, and is played so.

use std::ops::Range;
use std::sync::atomic::Ordering::Relaxed;

use pogema_core::{Action, Cell, Collision, Occupancy};
use rayon::prelude::*;

use crate::Engine;
use crate::grid::{FREE, NOBODY, OBSTACLE};

/// Agents that one thread takes at a time.
const CHUNK: usize = 4096;
/// A claim of two.
const CONTESTED: u32 = NOBODY - 1;

impl Engine {
    /// Moves the active agents as their actions and the collision system allow.
    ///
    /// Rule: move/actions, move/inactive
    pub(crate) fn move_agents(&mut self, actions: &[Action]) {
        let pool = self.pool.clone().filter(|_| actions.len() > CHUNK);
        match (self.config.collision, pool) {
            (Collision::Priority, _) => self.move_by_priority(actions),
            (Collision::BlockBoth, None) => self.move_blocking_both::<false>(actions),
            (Collision::BlockBoth, Some(pool)) => pool.install(|| self.move_blocking_both::<true>(actions)),
            (Collision::Soft, None) => self.move_softly::<false>(actions),
            (Collision::Soft, Some(pool)) => pool.install(|| self.move_softly::<true>(actions)),
        }
    }

    /// One agent after the other, the lowest index first, onto any cell that is free at that moment.
    ///
    /// Rule: collide/priority, collide/priority/contest, collide/priority/follow, collide/priority/swap
    fn move_by_priority(&mut self, actions: &[Action]) {
        let offsets = self.board.offsets();
        let radius = self.config.radius;
        for (agent, &action) in actions.iter().enumerate() {
            let from = self.cells[agent];
            let place = self.board.place(from);
            let target = place.wrapping_add(offsets[action as usize]);
            if !self.active[agent] || self.board.square(target).agent.load(Relaxed) != FREE {
                continue;
            }
            let to = moved(from, action);
            self.vacate(place, agent);
            self.board.square(target).agent.store(agent as u32, Relaxed);
            self.occupied.clear(usize::from(from.row) + radius, usize::from(from.col) + radius);
            self.mark::<false>(to);
            self.cells[agent] = to;
        }
    }

    /// Onto a cell that was empty before the step and that no other agent wants.
    ///
    /// Rule: collide/block-both, collide/block-both/contest, collide/block-both/occupied
    fn move_blocking_both<const SHARED: bool>(&mut self, actions: &[Action]) {
        self.aim::<SHARED>(actions);
        self.over_agents::<SHARED>(|agents| {
            for agent in agents {
                if self.ahead[agent] == FREE {
                    self.claim_alone::<SHARED>(agent as u32, self.targets[agent]);
                }
            }
        });
        self.over_agents::<SHARED>(|agents| self.leave_squares(agents));
        self.enter::<SHARED>(actions);
        self.over_agents::<SHARED>(|agents| {
            for agent in agents {
                if self.ahead[agent] == FREE {
                    self.board.square(self.targets[agent]).claim.store(NOBODY, Relaxed);
                }
            }
        });
    }

    /// Everybody at once, except where that is impossible.
    ///
    /// Rule: collide/soft, occupancy/as-released, occupancy/exact
    fn move_softly<const SHARED: bool>(&mut self, actions: &[Action]) {
        self.aim::<SHARED>(actions);
        self.over_agents::<SHARED>(|agents| self.claim_targets::<SHARED>(agents));
        self.over_agents::<SHARED>(|agents| self.withdraw_hindered(agents));
        self.over_agents::<SHARED>(|agents| self.leave_squares(agents));
        self.enter::<SHARED>(actions);
    }

    /// Finds what each agent aims at; its own place if it waits, is gone or faces an obstacle.
    ///
    /// The marks of all agents are wiped on the way, since [`Engine::enter`] sets them again.
    fn aim<const SHARED: bool>(&mut self, actions: &[Action]) {
        let (board, occupied, radius) = (&self.board, &self.occupied, self.config.radius);
        let offsets = board.offsets();
        let num_agents = actions.len();
        let aim = |(first, targets, ahead): Aims<'_>| {
            let agents = first..first + ahead.len();
            let (actions, cells) = (&actions[agents.clone()], &self.cells[agents.clone()]);
            let active = &self.active[agents.clone()];
            for (index, agent) in agents.enumerate() {
                let cell = cells[index];
                let place = board.place(cell);
                let target = place.wrapping_add(offsets[actions[index] as usize]);
                let there = board.square(target).agent.load(Relaxed);
                let stays = there == OBSTACLE || !active[index];
                targets[index] = if stays { place } else { target };
                ahead[index] = if stays { agent as u32 } else { there };
                occupied.blank(usize::from(cell.row) + radius, usize::from(cell.col) + radius);
            }
        };
        let targets = &mut self.targets[..num_agents];
        if SHARED {
            let chunks = targets.par_chunks_mut(CHUNK).zip(self.ahead.par_chunks_mut(CHUNK)).enumerate();
            chunks.for_each(|(chunk, (targets, ahead))| aim((chunk * CHUNK, targets, ahead)));
        } else {
            aim((0, targets, &mut self.ahead));
        }
    }

    /// Every agent that does not wait or swap claims its target. A wait is a swap with oneself.
    ///
    /// Rule: collide/soft/stay, collide/soft/swap, collide/soft/contest
    fn claim_targets<const SHARED: bool>(&self, agents: Range<usize>) {
        let none = self.config.num_agents;
        for agent in agents {
            let place = self.board.place(self.cells[agent]);
            let opposite = self.targets[(self.ahead[agent] as usize).min(none)];
            // Where nothing is claimed the corner of the wall takes the number, which nobody aims at.
            let claimed = if opposite == place { 0 } else { self.targets[agent] };
            let claim = &self.board.square(claimed).claim;
            if SHARED {
                if claimed != 0 {
                    claim.fetch_min(agent as u32, Relaxed);
                }
            } else {
                claim.store(claim.load(Relaxed).min(agent as u32), Relaxed);
            }
        }
    }

    /// Claims an empty square, unless another agent has, and then nobody gets it.
    fn claim_alone<const SHARED: bool>(&self, agent: u32, target: u32) {
        let claim = &self.board.square(target).claim;
        if SHARED {
            if claim.compare_exchange(NOBODY, agent, Relaxed, Relaxed).is_err() {
                claim.store(CONTESTED, Relaxed);
            }
        } else {
            let is_first = claim.load(Relaxed) == NOBODY;
            claim.store(if is_first { agent } else { CONTESTED }, Relaxed);
        }
    }

    /// Takes back the claim on the cell of each agent that stays, and so on along the queue behind it.
    ///
    /// Rule: collide/soft/chain
    fn withdraw_hindered(&self, agents: Range<usize>) {
        for agent in agents {
            let mut place = self.board.place(self.cells[agent]);
            if self.board.square(place).claim.load(Relaxed) == NOBODY
                || !self.active[agent]
                || self.moves(agent as u32)
            {
                continue;
            }
            loop {
                let behind = self.board.square(place).claim.swap(NOBODY, Relaxed);
                if behind == NOBODY {
                    break;
                }
                place = self.board.place(self.cells[behind as usize]);
            }
        }
    }

    /// Whether an agent holds the claim on its target.
    fn moves(&self, agent: u32) -> bool {
        self.board.square(self.targets[agent as usize]).claim.load(Relaxed) == agent
    }

    fn leave_squares(&self, agents: Range<usize>) {
        for agent in agents {
            if self.moves(agent as u32) {
                self.vacate(self.board.place(self.cells[agent]), agent);
            }
        }
    }

    /// Frees a square, unless it is an obstacle that the agent started on.
    pub(crate) fn vacate(&self, place: u32, agent: usize) {
        let square = self.board.square(place);
        if square.agent.load(Relaxed) == agent as u32 {
            square.agent.store(FREE, Relaxed);
        }
    }

    /// Moves the agents that hold claims, and marks all. As released, an agent that enters the cell which an agent
    /// with a higher index leaves in the same step has its mark wiped by it.
    ///
    /// Rule: occupancy/as-released, occupancy/exact
    fn enter<const SHARED: bool>(&mut self, actions: &[Action]) {
        let (board, occupied, radius) = (&self.board, &self.occupied, self.config.radius);
        let (targets, ahead, active) = (&self.targets, &self.ahead, &self.active);
        let shows_all = self.config.occupancy == Occupancy::Exact;
        let enter = |(first, cells): (usize, &mut [Cell])| {
            for (index, cell) in cells.iter_mut().enumerate() {
                let agent = first + index;
                let square = board.square(targets[agent]);
                let mut is_shown = active[agent];
                if square.claim.load(Relaxed) == agent as u32 {
                    square.claim.store(NOBODY, Relaxed);
                    square.agent.store(agent as u32, Relaxed);
                    *cell = moved(*cell, actions[agent]);
                    is_shown &= shows_all || ahead[agent] == FREE || ahead[agent] < agent as u32;
                }
                if is_shown {
                    occupied.set::<SHARED>(usize::from(cell.row) + radius, usize::from(cell.col) + radius);
                }
            }
        };
        if SHARED {
            let chunks = self.cells.par_chunks_mut(CHUNK).enumerate();
            chunks.for_each(|(chunk, cells)| enter((chunk * CHUNK, cells)));
        } else {
            enter((0, &mut self.cells));
        }
    }

    /// Does the same for all agents, in parallel if `SHARED`.
    fn over_agents<const SHARED: bool>(&self, work: impl Fn(Range<usize>) + Sync) {
        let num_agents = self.config.num_agents;
        if SHARED {
            let firsts = (0..num_agents).into_par_iter().step_by(CHUNK);
            firsts.for_each(|first| work(first..num_agents.min(first + CHUNK)));
        } else {
            work(0..num_agents);
        }
    }

    /// Puts all active agents on their squares.
    pub(crate) fn take_squares(&self) {
        for (agent, &cell) in self.cells.iter().enumerate().filter(|&(agent, _)| self.active[agent]) {
            let square = self.board.square(self.board.place(cell));
            if square.agent.load(Relaxed) == FREE {
                square.agent.store(agent as u32, Relaxed);
            }
        }
    }
}

/// The first agent of a part, the targets of the part and what stands there.
type Aims<'a> = (usize, &'a mut [u32], &'a mut [u32]);

/// The neighbour of a cell; an agent only goes where there is one.
fn moved(cell: Cell, action: Action) -> Cell {
    let (row, col) = cell.toward(action);
    Cell::new(row as u16, col as u16)
}
