//! Conflicting moves under the three collision systems.
//!
//! The reference defines the systems. Here every agent first claims the square it requests. Under `soft`, the agent
//! with the lowest index wins a square; under `block_both`, a square that several agents request goes to none of them.
//! The order in which agents are processed therefore does not matter, and threads can share the work. Only `priority`
//! processes agents in index order, because its rule requires this.

#![allow(clippy::needless_bitwise_bool, reason = "branches on moves are hard to predict and slow")]

use std::hint::select_unpredictable;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use pogema_core::{Action, Cell, Collision, Occupancy};
use rayon::prelude::*;

use crate::Engine;
use crate::grid::{Board, FREE, NO_AGENT, OBSTACLE};
use crate::simd::prefetch;

/// Number of agents that one thread processes at a time.
pub(crate) const CHUNK: usize = 4096;
/// The claim on a square that several agents request.
const CONTESTED: u32 = NO_AGENT - 1;
/// Largest number of squares of a board that stays in the cache.
const MAX_NEAR: usize = 1 << 16;
/// Number of agents from the current one to the one whose square is prefetched.
const AHEAD: usize = 32;

/// The way in which a step processes the agents.
trait Traversal {
    /// Whether several threads work at the same time.
    const SHARED: bool;
    /// Whether squares are prefetched, because the board may be larger than the cache.
    const FAR: bool;
}

/// One thread, with a board that stays in the cache.
struct Near;
/// One thread, with a board larger than the cache.
struct Far;
/// Several threads.
struct Shared;

impl Traversal for Near {
    const SHARED: bool = false;
    const FAR: bool = false;
}

impl Traversal for Far {
    const SHARED: bool = false;
    const FAR: bool = true;
}

impl Traversal for Shared {
    const SHARED: bool = true;
    const FAR: bool = true;
}

impl Engine {
    /// Moves the active agents by their actions, as far as the collision system allows.
    ///
    /// Rule: move/actions, move/inactive
    pub(crate) fn move_agents(&mut self, actions: &[Action]) {
        match self.pool.clone().filter(|_| actions.len() > CHUNK) {
            Some(pool) => pool.install(|| self.move_in::<Shared>(actions)),
            None if self.board.num_squares() > MAX_NEAR => self.move_in::<Far>(actions),
            None => self.move_in::<Near>(actions),
        }
    }

    fn move_in<W: Traversal>(&mut self, actions: &[Action]) {
        match self.config.collision {
            Collision::Priority => self.move_by_priority(actions),
            Collision::BlockBoth => self.move_blocking_both::<W>(actions),
            Collision::Soft => self.move_softly::<W>(actions),
        }
    }

    /// Moves one agent after another, lowest index first, onto any cell that is unoccupied at that moment.
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
            self.vacate(place, agent as u32);
            self.board.square(target).agent.store(agent as u32, Relaxed);
            self.occupied.clear(usize::from(from.row) + radius, usize::from(from.col) + radius);
            self.mark(to);
            self.cells[agent] = to;
        }
    }

    /// Moves agents onto cells that were unoccupied before the step and that no other agent requests.
    ///
    /// Rule: collide/block-both, collide/block-both/contest, collide/block-both/occupied
    fn move_blocking_both<W: Traversal>(&mut self, actions: &[Action]) {
        self.aim::<W>(actions, |requests, agent, target, there| {
            if there == FREE {
                claim_alone::<W>(&requests.board.square(target).claim, agent);
            }
        });
        self.enter::<W>(actions);
        self.over_agents::<W>(|agents| {
            for agent in agents {
                if self.ahead[agent] == FREE {
                    self.board.square(self.targets[agent]).claim.store(NO_AGENT, Relaxed);
                }
            }
        });
    }

    /// Moves all agents simultaneously, and reverts only impossible moves.
    ///
    /// Rule: collide/soft, occupancy/as-released, occupancy/exact
    fn move_softly<W: Traversal>(&mut self, actions: &[Action]) {
        self.aim::<W>(actions, claim_unless_swapping::<W>);
        self.over_agents::<W>(|agents| self.withdraw_hindered::<W>(agents));
        self.enter::<W>(actions);
    }

    /// Stores the target of each agent and the content of that square, then claims the square by the rule of the
    /// collision system.
    ///
    /// For an inactive agent, the content counts as an obstacle. The marks of all agents are cleared, since
    /// [`Engine::enter`] sets them again.
    fn aim<W: Traversal>(&mut self, actions: &[Action], claim: impl Fn(&Requests<'_>, u32, u32, u32) + Sync) {
        let (board, cells, active) = (&self.board, &self.cells[..], &self.active[..]);
        let requests = Requests { board, cells, actions, offsets: board.offsets() };
        let (occupied, radius) = (&self.occupied, self.config.radius);
        let aim = |(first, targets, ahead): Aims<'_>| {
            for (index, (aim, found)) in targets.iter_mut().zip(ahead).enumerate() {
                let agent = first + index;
                prefetch_ahead::<W>(board, agent, cells.len(), |later| requests.target(later));
                let target = requests.target(agent);
                let square = board.square(target).agent.load(Relaxed);
                let there = if active[agent] { square } else { OBSTACLE };
                claim(&requests, agent as u32, target, there);
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

    /// Withdraws the claim on the cell of each agent that stays, then the claims on the cells of the agents queued
    /// behind it.
    ///
    /// Rule: collide/soft/chain
    fn withdraw_hindered<W: Traversal>(&self, agents: Range<usize>) {
        for agent in agents {
            prefetch_ahead::<W>(&self.board, agent, self.cells.len(), |later| {
                self.board.place(self.cells[later])
            });
            let mut place = self.board.place(self.cells[agent]);
            if self.board.square(place).claim.load(Relaxed) == NO_AGENT
                || !self.active[agent]
                || self.moves(agent as u32)
            {
                continue;
            }
            loop {
                let behind = self.board.square(place).claim.swap(NO_AGENT, Relaxed);
                if behind == NO_AGENT {
                    break;
                }
                place = self.board.place(self.cells[behind as usize]);
            }
        }
    }

    /// Returns whether an agent holds the claim on its target.
    fn moves(&self, agent: u32) -> bool {
        self.board.square(self.targets[agent as usize]).claim.load(Relaxed) == agent
    }

    /// Frees a square, unless another agent has already entered it or it is an obstacle that the agent started on.
    #[inline]
    pub(crate) fn vacate(&self, place: u32, agent: u32) {
        let square = &self.board.square(place).agent;
        if square.load(Relaxed) == agent {
            square.store(FREE, Relaxed);
        }
    }

    /// Moves an agent on the board, from `place` to its target, if it holds the claim on the target. Returns whether
    /// the agent moves.
    fn take_target<W: Traversal>(&self, agent: u32, place: u32) -> bool {
        let square = self.board.square(self.targets[agent as usize]);
        let claim = square.claim.load(Relaxed);
        let moves = claim == agent;
        let left = &self.board.square(place).agent;
        if !W::SHARED {
            square.claim.store(select_unpredictable(moves, NO_AGENT, claim), Relaxed);
            let there = square.agent.load(Relaxed);
            square.agent.store(select_unpredictable(moves, agent, there), Relaxed);
            let here = left.load(Relaxed);
            left.store(select_unpredictable(moves & (here == agent), FREE, here), Relaxed);
        } else if moves {
            square.claim.store(NO_AGENT, Relaxed);
            square.agent.store(agent, Relaxed);
            // Another agent may enter the square `left` before or after this exchange.
            let _ = left.compare_exchange(agent, FREE, Relaxed, Relaxed);
        }
        moves
    }

    /// Moves the agents that hold claims, and marks all active agents.
    ///
    /// With `as_released`, an agent loses its mark if it enters a cell that an agent with a higher index leaves in the
    /// same step.
    ///
    /// Rule: occupancy/as-released, occupancy/exact
    fn enter<W: Traversal>(&mut self, actions: &[Action]) {
        let mut cells = std::mem::take(&mut self.cells);
        let (board, occupied, radius) = (&self.board, &self.occupied, self.config.radius);
        let (targets, ahead, active) = (&self.targets, &self.ahead, &self.active);
        let shows_all = self.config.occupancy == Occupancy::Exact;
        let enter = |(first, cells): (usize, &mut [Cell])| {
            for index in 0..cells.len() {
                let agent = first + index;
                prefetch_ahead::<W>(board, agent, targets.len(), |later| targets[later]);
                prefetch_ahead::<W>(board, index, cells.len(), |later| board.place(cells[later]));
                let (number, cell) = (agent as u32, &mut cells[index]);
                let moves = self.take_target::<W>(number, board.place(*cell));
                *cell = select_unpredictable(moves, moved(*cell, actions[agent]), *cell);
                let keeps_mark = shows_all | (ahead[agent] == FREE) | (ahead[agent] < number);
                let is_shown = active[agent] & (!moves | keeps_mark);
                let (row, col) = (usize::from(cell.row) + radius, usize::from(cell.col) + radius);
                occupied.set_if(is_shown, row, col, W::SHARED);
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

    /// Does some work for all agents, in parallel if the traversal is shared.
    fn over_agents<W: Traversal>(&self, work: impl Fn(Range<usize>) + Sync) {
        let num_agents = self.config.num_agents;
        if W::SHARED {
            let firsts = (0..num_agents).into_par_iter().step_by(CHUNK);
            firsts.for_each(|first| work(first..num_agents.min(first + CHUNK)));
        } else {
            work(0..num_agents);
        }
    }

    /// Places all active agents on their squares.
    pub(crate) fn place_agents(&self) {
        for (agent, &cell) in self.cells.iter().enumerate().filter(|&(agent, _)| self.active[agent]) {
            let square = self.board.square(self.board.place(cell));
            if square.agent.load(Relaxed) == FREE {
                square.agent.store(agent as u32, Relaxed);
            }
        }
    }
}

/// Prefetches the square of the agent that is processed [`AHEAD`] agents later.
#[inline]
fn prefetch_ahead<W: Traversal>(
    board: &Board,
    agent: usize,
    num_agents: usize,
    place: impl Fn(usize) -> u32,
) {
    let later = agent + AHEAD;
    if W::FAR && later < num_agents {
        prefetch(board.square(place(later)));
    }
}

/// The agents of a step and the moves they request.
struct Requests<'a> {
    board: &'a Board,
    cells: &'a [Cell],
    actions: &'a [Action],
    offsets: [u32; 5],
}

impl Requests<'_> {
    /// Returns the square that an agent requests.
    fn target(&self, agent: usize) -> u32 {
        self.board.place(self.cells[agent]).wrapping_add(self.offsets[self.actions[agent] as usize])
    }
}

/// Claims a target for an agent, unless the agent moves into an obstacle or swaps.
///
/// If several agents claim a target, the lowest index gets it. A waiting agent counts as swapping with itself.
///
/// Rule: collide/soft/stay, collide/soft/swap, collide/soft/contest
fn claim_unless_swapping<W: Traversal>(requests: &Requests<'_>, agent: u32, target: u32, there: u32) {
    let other = select_unpredictable(there < FREE, there, agent);
    let stays = (there == OBSTACLE)
        | (requests.target(other as usize) == requests.board.place(requests.cells[agent as usize]));
    let claim = &requests.board.square(target).claim;
    if !W::SHARED {
        // One thread processes the agents in index order, so an earlier claim has a lower index.
        let earlier = claim.load(Relaxed);
        claim.store(select_unpredictable(!stays & (earlier == NO_AGENT), agent, earlier), Relaxed);
    } else if !stays {
        claim.fetch_min(agent, Relaxed);
    }
}

/// Claims an empty square. If another agent has already claimed it, no agent gets it.
fn claim_alone<W: Traversal>(claim: &AtomicU32, agent: u32) {
    if !W::SHARED {
        let is_first = claim.load(Relaxed) == NO_AGENT;
        claim.store(if is_first { agent } else { CONTESTED }, Relaxed);
    } else if claim.compare_exchange(NO_AGENT, agent, Relaxed, Relaxed).is_err() {
        claim.store(CONTESTED, Relaxed);
    }
}

/// The first agent of a part, the targets of the part and the content of those squares.
type Aims<'a> = (usize, &'a mut [u32], &'a mut [u32]);

/// Returns the neighbour of a cell. Outside the map, where no agent moves, the result has no meaning.
fn moved(cell: Cell, action: Action) -> Cell {
    let (row, col) = cell.toward(action);
    Cell::new(row as u16, col as u16)
}
