//! Who may move: the three collision systems.
//!
//! The reference says what each system means. Here every agent first names the square it aims at; then each
//! square decides by itself, through a claim that the lowest index wins, so that the order of the agents does not
//! matter and the work can be shared among threads. Only `priority` is an order by definition, and is played so.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use pogema_core::{Action, Cell, Collision, Occupancy};
use rayon::prelude::*;

use crate::Engine;
use crate::grid::{Board, FREE, NOBODY, OBSTACLE};
use crate::simd::fetch;

/// Agents that one thread takes at a time.
pub(crate) const CHUNK: usize = 4096;
/// A claim of two.
const CONTESTED: u32 = NOBODY - 1;
/// Boards of more squares do not stay near the processor.
const MOST_NEAR: usize = 1 << 16;
/// So many agents ahead of the present one the squares are asked for.
const AHEAD: usize = 32;

/// How the agents of a step are gone through.
trait Way {
    /// Whether several threads do it at the same time.
    const SHARED: bool;
    /// Whether squares have to be fetched from far away.
    const FAR: bool;
}

struct Near;
struct Far;
struct Shared;

impl Way for Near {
    const SHARED: bool = false;
    const FAR: bool = false;
}

impl Way for Far {
    const SHARED: bool = false;
    const FAR: bool = true;
}

impl Way for Shared {
    const SHARED: bool = true;
    const FAR: bool = true;
}

impl Engine {
    /// Moves the active agents as their actions and the collision system allow.
    ///
    /// Rule: move/actions, move/inactive
    pub(crate) fn move_agents(&mut self, actions: &[Action]) {
        match self.pool.clone().filter(|_| actions.len() > CHUNK) {
            Some(pool) => pool.install(|| self.move_in::<Shared>(actions)),
            None if self.board.num_squares() > MOST_NEAR => self.move_in::<Far>(actions),
            None => self.move_in::<Near>(actions),
        }
    }

    fn move_in<W: Way>(&mut self, actions: &[Action]) {
        match self.config.collision {
            Collision::Priority => self.move_by_priority(actions),
            Collision::BlockBoth => self.move_blocking_both::<W>(actions),
            Collision::Soft => self.move_softly::<W>(actions),
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
            self.vacate(place, agent as u32, false);
            self.board.square(target).agent.store(agent as u32, Relaxed);
            self.occupied.clear(usize::from(from.row) + radius, usize::from(from.col) + radius);
            self.mark(to);
            self.cells[agent] = to;
        }
    }

    /// Onto a cell that was empty before the step and that no other agent wants.
    ///
    /// Rule: collide/block-both, collide/block-both/contest, collide/block-both/occupied
    fn move_blocking_both<W: Way>(&mut self, actions: &[Action]) {
        self.aim::<W>(actions, |crowd, agent, target, there| {
            if there == FREE {
                claim_alone::<W>(&crowd.board.square(target).claim, agent);
            }
        });
        self.enter::<W>(actions);
        self.over_agents::<W>(|agents| {
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
    fn move_softly<W: Way>(&mut self, actions: &[Action]) {
        self.aim::<W>(actions, claim_unless_swapping::<W>);
        self.over_agents::<W>(|agents| self.withdraw_hindered::<W>(agents));
        self.enter::<W>(actions);
    }

    /// Finds what each agent aims at and what is there, where an agent that is gone finds an obstacle; then claims
    /// it, which the collision system says how.
    ///
    /// The marks of all agents are wiped on the way, since [`Engine::enter`] sets them again.
    fn aim<W: Way>(&mut self, actions: &[Action], claim: impl Fn(&Crowd<'_>, u32, u32, u32) + Sync) {
        let (board, cells, active) = (&self.board, &self.cells[..], &self.active[..]);
        let crowd = Crowd { board, cells, actions, offsets: board.offsets() };
        let (occupied, radius) = (&self.occupied, self.config.radius);
        let aim = |(first, targets, ahead): Aims<'_>| {
            for (index, (aim, found)) in targets.iter_mut().zip(ahead).enumerate() {
                let agent = first + index;
                fetch_ahead::<W>(board, agent, cells.len(), |later| crowd.target(later));
                let target = crowd.target(agent);
                let square = board.square(target).agent.load(Relaxed);
                let there = if active[agent] { square } else { OBSTACLE };
                claim(&crowd, agent as u32, target, there);
                (*aim, *found) = (target, there);
                let cell = cells[agent];
                occupied.blank(usize::from(cell.row) + radius, usize::from(cell.col) + radius);
            }
        };
        if W::SHARED {
            let chunks = self.targets.par_chunks_mut(CHUNK).zip(self.ahead.par_chunks_mut(CHUNK)).enumerate();
            chunks.for_each(|(chunk, (targets, ahead))| aim((chunk * CHUNK, targets, ahead)));
        } else {
            aim((0, &mut self.targets, &mut self.ahead));
        }
    }

    /// Takes back the claim on the cell of each agent that stays, and so on along the queue behind it.
    ///
    /// Rule: collide/soft/chain
    fn withdraw_hindered<W: Way>(&self, agents: Range<usize>) {
        for agent in agents {
            fetch_ahead::<W>(&self.board, agent, self.cells.len(), |later| {
                self.board.place(self.cells[later])
            });
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

    /// Frees a square, unless another agent has come already or it is an obstacle that the agent started on.
    #[inline]
    pub(crate) fn vacate(&self, place: u32, agent: u32, is_shared: bool) {
        let square = &self.board.square(place).agent;
        if is_shared {
            // Whoever comes may be there before or after this.
            let _ = square.compare_exchange(agent, FREE, Relaxed, Relaxed);
        } else if square.load(Relaxed) == agent {
            square.store(FREE, Relaxed);
        }
    }

    /// Moves the agents that hold claims, and marks all. As released, an agent that enters the cell which an agent
    /// with a higher index leaves in the same step has its mark wiped by it.
    ///
    /// Rule: occupancy/as-released, occupancy/exact
    fn enter<W: Way>(&mut self, actions: &[Action]) {
        let mut cells = std::mem::take(&mut self.cells);
        let (board, occupied, radius) = (&self.board, &self.occupied, self.config.radius);
        let (targets, ahead, active) = (&self.targets, &self.ahead, &self.active);
        let shows_all = self.config.occupancy == Occupancy::Exact;
        let enter = |(first, cells): (usize, &mut [Cell])| {
            for index in 0..cells.len() {
                let agent = first + index;
                fetch_ahead::<W>(board, agent, targets.len(), |later| targets[later]);
                fetch_ahead::<W>(board, index, cells.len(), |later| board.place(cells[later]));
                let (number, cell) = (agent as u32, &mut cells[index]);
                let square = board.square(targets[agent]);
                let mut is_shown = active[agent];
                if square.claim.load(Relaxed) == number {
                    square.claim.store(NOBODY, Relaxed);
                    square.agent.store(number, Relaxed);
                    self.vacate(board.place(*cell), number, W::SHARED);
                    *cell = moved(*cell, actions[agent]);
                    is_shown &= shows_all || ahead[agent] == FREE || ahead[agent] < number;
                }
                if is_shown {
                    occupied.set(usize::from(cell.row) + radius, usize::from(cell.col) + radius, W::SHARED);
                }
            }
        };
        if W::SHARED {
            let chunks = cells.par_chunks_mut(CHUNK).enumerate();
            chunks.for_each(|(chunk, cells)| enter((chunk * CHUNK, cells)));
        } else {
            enter((0, &mut cells));
        }
        self.cells = cells;
    }

    /// Does the same for all agents, in parallel if the way is shared.
    fn over_agents<W: Way>(&self, work: impl Fn(Range<usize>) + Sync) {
        let num_agents = self.config.num_agents;
        if W::SHARED {
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

/// Asks for a square that is needed some agents later.
#[inline]
fn fetch_ahead<W: Way>(board: &Board, agent: usize, num_agents: usize, place: impl Fn(usize) -> u32) {
    let later = agent + AHEAD;
    if W::FAR && later < num_agents {
        fetch(board.square(place(later)));
    }
}

/// The agents of a step, and what they want.
struct Crowd<'a> {
    board: &'a Board,
    cells: &'a [Cell],
    actions: &'a [Action],
    offsets: [u32; 5],
}

impl Crowd<'_> {
    /// The place that an agent aims at.
    fn target(&self, agent: usize) -> u32 {
        self.board.place(self.cells[agent]).wrapping_add(self.offsets[self.actions[agent] as usize])
    }
}

/// Claims a target for the lowest index that wants it, unless the agent faces an obstacle or swaps; and a wait is a
/// swap with oneself.
///
/// Rule: collide/soft/stay, collide/soft/swap, collide/soft/contest
fn claim_unless_swapping<W: Way>(crowd: &Crowd<'_>, agent: u32, target: u32, there: u32) {
    let other = if there < FREE { there } else { agent };
    let stays =
        there == OBSTACLE || crowd.target(other as usize) == crowd.board.place(crowd.cells[agent as usize]);
    // Where nothing is claimed the corner of the wall takes the number, which nobody aims at.
    let claim = &crowd.board.square(if stays { 0 } else { target }).claim;
    if !W::SHARED {
        claim.store(claim.load(Relaxed).min(agent), Relaxed);
    } else if !stays {
        claim.fetch_min(agent, Relaxed);
    }
}

/// Claims an empty square, unless another agent has, and then nobody gets it.
fn claim_alone<W: Way>(claim: &AtomicU32, agent: u32) {
    if !W::SHARED {
        let is_first = claim.load(Relaxed) == NOBODY;
        claim.store(if is_first { agent } else { CONTESTED }, Relaxed);
    } else if claim.compare_exchange(NOBODY, agent, Relaxed, Relaxed).is_err() {
        claim.store(CONTESTED, Relaxed);
    }
}

/// The first agent of a part, the targets of the part and what stands there.
type Aims<'a> = (usize, &'a mut [u32], &'a mut [u32]);

/// The neighbour of a cell; an agent only goes where there is one.
fn moved(cell: Cell, action: Action) -> Cell {
    let (row, col) = cell.toward(action);
    Cell::new(row as u16, col as u16)
}
