//! The reservation table of the LNS: one bit and one agent for each vertex and time.

use crate::graph::Vertex;
use crate::problem::Agent;

/// The vertex of an agent at each time until it stays forever.
pub(crate) type Path = Vec<Vertex>;

/// No agent.
const NO_AGENT: u16 = u16::MAX;

/// The occupied vertices and times, as bits and by agent. Paths in the table do not conflict.
#[derive(Debug)]
pub(crate) struct TimeTable {
    /// Number of time steps, from 0.
    span: usize,
    /// Number of words of bits for each vertex.
    words: usize,
    /// Shape: `[vertices, words]`; a bit is set while the vertex is occupied.
    busy: Vec<u64>,
    /// Shape: `[vertices, span]`; the agent that passes, without agents that rest.
    passing: Vec<u16>,
    /// For each vertex, the agent whose path ends there.
    resting: Vec<u16>,
}

impl TimeTable {
    /// The limit on the number of agents.
    pub const MAX_AGENTS: usize = NO_AGENT as usize;

    /// Returns the memory of a table. Units: bytes.
    pub fn num_bytes(num_vertices: usize, span: usize) -> usize {
        num_vertices * (span * size_of::<u16>() + span.div_ceil(64) * size_of::<u64>() + size_of::<u16>())
    }

    /// Creates an empty table for times below `span`.
    pub fn new(num_vertices: usize, span: usize) -> Self {
        let words = span.div_ceil(64);
        Self {
            span,
            words,
            busy: vec![0; num_vertices * words],
            passing: vec![NO_AGENT; num_vertices * span],
            resting: vec![NO_AGENT; num_vertices],
        }
    }

    /// Returns the number of time steps.
    pub fn span(&self) -> u32 {
        self.span as u32
    }

    /// Adds a path that is free of conflicts.
    pub fn add(&mut self, agent: Agent, path: &[Vertex]) {
        for (time, &vertex) in path.iter().enumerate() {
            self.passing[vertex as usize * self.span + time] = agent as u16;
            self.busy[vertex as usize * self.words + time / 64] |= 1 << (time % 64);
        }
        if let Some(&last) = path.last() {
            self.resting[last as usize] = agent as u16;
            self.rest(last, path.len(), |word, mask| *word |= mask);
        }
    }

    /// Removes a path.
    pub fn remove(&mut self, path: &[Vertex]) {
        for (time, &vertex) in path.iter().enumerate() {
            self.passing[vertex as usize * self.span + time] = NO_AGENT;
            self.busy[vertex as usize * self.words + time / 64] &= !(1 << (time % 64));
        }
        if let Some(&last) = path.last() {
            self.resting[last as usize] = NO_AGENT;
            self.rest(last, path.len(), |word, mask| *word &= !mask);
        }
    }

    /// Changes all bits of a vertex from a time on.
    fn rest(&mut self, vertex: Vertex, from: usize, change: impl Fn(&mut u64, u64)) {
        let row = &mut self.busy[vertex as usize * self.words..][..self.words];
        for (index, word) in row.iter_mut().enumerate().skip(from / 64) {
            let mask = if index == from / 64 { u64::MAX << (from % 64) } else { u64::MAX };
            change(word, mask);
        }
    }

    /// Returns the agent at a vertex at a time.
    pub fn agent_at(&self, vertex: Vertex, time: u32) -> Option<Agent> {
        let passing = self.passing[vertex as usize * self.span + time as usize];
        let agent = if passing == NO_AGENT && self.is_busy(vertex, time) {
            self.resting[vertex as usize]
        } else {
            passing
        };
        (agent != NO_AGENT).then_some(Agent::from(agent))
    }

    /// Returns whether a vertex is occupied at a time.
    #[inline]
    pub fn is_busy(&self, vertex: Vertex, time: u32) -> bool {
        self.busy[vertex as usize * self.words + time as usize / 64] >> (time % 64) & 1 == 1
    }

    /// Returns the first time at or after `from` at which a vertex is occupied, or the span.
    #[inline]
    pub fn next_busy(&self, vertex: Vertex, from: u32) -> u32 {
        self.next(vertex, from, 0)
    }

    /// Returns the first time at or after `from` at which a vertex is free, or the span.
    #[inline]
    pub fn next_free(&self, vertex: Vertex, from: u32) -> u32 {
        self.next(vertex, from, u64::MAX)
    }

    #[inline]
    fn next(&self, vertex: Vertex, from: u32, flip: u64) -> u32 {
        let row = &self.busy[vertex as usize * self.words..][..self.words];
        let first = from as usize / 64;
        let mut mask = u64::MAX << (from % 64);
        for (index, word) in row.iter().enumerate().skip(first) {
            let bits = (word ^ flip) & mask;
            if bits != 0 {
                return (index as u32 * 64 + bits.trailing_zeros()).min(self.span());
            }
            mask = u64::MAX;
        }
        self.span()
    }

    /// Returns the start of a vertex's safe interval at a time.
    ///
    /// If the vertex is occupied at that time, returns the start of its next safe interval, or the span if there is
    /// none.
    #[inline]
    pub fn free_since_or_next(&self, vertex: Vertex, time: u32) -> u32 {
        if self.is_busy(vertex, time) { self.next_free(vertex, time) } else { self.free_since(vertex, time) }
    }

    #[inline]
    fn free_since(&self, vertex: Vertex, time: u32) -> u32 {
        let row = &self.busy[vertex as usize * self.words..][..self.words];
        let mut mask = u64::MAX >> (63 - time % 64);
        for index in (0..=time as usize / 64).rev() {
            let bits = row[index] & mask;
            if bits != 0 {
                return index as u32 * 64 + 64 - bits.leading_zeros();
            }
            mask = u64::MAX;
        }
        0
    }

    /// Returns whether a move that ends at a time swaps with another agent.
    #[inline]
    pub fn is_swap(&self, from: Vertex, to: Vertex, time: u32) -> bool {
        let before = self.passing[to as usize * self.span + time as usize - 1];
        before != NO_AGENT && before == self.passing[from as usize * self.span + time as usize]
    }

    /// Returns whether a path is free of conflicts.
    pub fn is_free(&self, path: &[Vertex]) -> bool {
        let passes = path.iter().enumerate().all(|(time, &vertex)| {
            let before = path[time.saturating_sub(1)];
            !self.is_busy(vertex, time as u32)
                && (before == vertex || !self.is_swap(before, vertex, time as u32))
        });
        let end = path.len() as u32;
        passes
            && path.last().is_none_or(|&last| end >= self.span() || self.next_busy(last, end) == self.span())
    }
}
