//! Who is where and when: the paths that a new one has to keep clear of.

use crate::graph::Vertex;
use crate::stepper::Agent;

/// Where an agent is at each time until it stays; it then stays for good.
pub(crate) type Path = Vec<Vertex>;

/// Nobody.
const NOBODY: u16 = u16::MAX;

/// The vertices and times that agents take, as bits and by agent.
#[derive(Debug)]
pub(crate) struct Reservations {
    /// Number of times, from 0.
    span: usize,
    /// Words of bits for each vertex.
    words: usize,
    busy: Vec<u64>,
    /// For each vertex and time, who comes by; who rests there is not entered.
    who: Vec<u16>,
    /// For each vertex, who rests there in the end.
    resting: Vec<u16>,
}

impl Reservations {
    /// Most agents whose numbers fit.
    pub const MOST_AGENTS: usize = NOBODY as usize;

    /// Bytes that reservations take for so many vertices and times.
    pub fn bytes(num_vertices: usize, span: usize) -> usize {
        num_vertices * (span * size_of::<u16>() + span.div_ceil(64) * size_of::<u64>() + size_of::<u16>())
    }

    /// No reservations, for times below `span`.
    pub fn new(num_vertices: usize, span: usize) -> Self {
        let words = span.div_ceil(64);
        Self {
            span,
            words,
            busy: vec![0; num_vertices * words],
            who: vec![NOBODY; num_vertices * span],
            resting: vec![NOBODY; num_vertices],
        }
    }

    /// Number of times.
    pub fn span(&self) -> u32 {
        self.span as u32
    }

    /// Enters a path that is free.
    pub fn add(&mut self, agent: Agent, path: &[Vertex]) {
        for (time, &vertex) in path.iter().enumerate() {
            self.who[vertex as usize * self.span + time] = agent as u16;
            self.busy[vertex as usize * self.words + time / 64] |= 1 << (time % 64);
        }
        if let Some(&last) = path.last() {
            self.resting[last as usize] = agent as u16;
            self.rest(last, path.len(), |word, mask| *word |= mask);
        }
    }

    /// Takes a path out that was entered.
    pub fn remove(&mut self, path: &[Vertex]) {
        for (time, &vertex) in path.iter().enumerate() {
            self.who[vertex as usize * self.span + time] = NOBODY;
            self.busy[vertex as usize * self.words + time / 64] &= !(1 << (time % 64));
        }
        if let Some(&last) = path.last() {
            self.resting[last as usize] = NOBODY;
            self.rest(last, path.len(), |word, mask| *word &= !mask);
        }
    }

    /// Does something to all bits of a vertex from a time on.
    fn rest(&mut self, vertex: Vertex, from: usize, change: impl Fn(&mut u64, u64)) {
        let row = &mut self.busy[vertex as usize * self.words..][..self.words];
        for (index, word) in row.iter_mut().enumerate().skip(from / 64) {
            let mask = if index == from / 64 { u64::MAX << (from % 64) } else { u64::MAX };
            change(word, mask);
        }
    }

    /// Who is at a vertex at a time.
    pub fn agent_at(&self, vertex: Vertex, time: u32) -> Option<Agent> {
        let passing = self.who[vertex as usize * self.span + time as usize];
        let agent = if passing == NOBODY && self.is_busy(vertex, time) {
            self.resting[vertex as usize]
        } else {
            passing
        };
        (agent != NOBODY).then_some(Agent::from(agent))
    }

    /// Whether somebody is at a vertex at a time.
    #[inline]
    pub fn is_busy(&self, vertex: Vertex, time: u32) -> bool {
        self.busy[vertex as usize * self.words + time as usize / 64] >> (time % 64) & 1 == 1
    }

    /// The first time from one on at which a vertex is taken, or the span.
    #[inline]
    pub fn next_busy(&self, vertex: Vertex, from: u32) -> u32 {
        self.next(vertex, from, 0)
    }

    /// The first time from one on at which a vertex is free, or the span.
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

    /// Since when a vertex has been free that is free at a time, or else when it is next, or the span.
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

    /// Whether somebody comes the other way as an agent goes, to be there at a time.
    #[inline]
    pub fn is_met(&self, from: Vertex, to: Vertex, time: u32) -> bool {
        let before = self.who[to as usize * self.span + time as usize - 1];
        before != NOBODY && before == self.who[from as usize * self.span + time as usize]
    }

    /// Whether a path meets nobody.
    pub fn is_free(&self, path: &[Vertex]) -> bool {
        let passes = path.iter().enumerate().all(|(time, &vertex)| {
            let before = path[time.saturating_sub(1)];
            !self.is_busy(vertex, time as u32)
                && (before == vertex || !self.is_met(before, vertex, time as u32))
        });
        let end = path.len() as u32;
        passes
            && path.last().is_none_or(|&last| end >= self.span() || self.next_busy(last, end) == self.span())
    }
}
