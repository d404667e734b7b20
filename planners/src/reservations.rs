//! The reservation table: the intervals during which agents occupy each vertex.

use crate::graph::Vertex;

/// Stands for the last step of a reservation that never ends.
pub(crate) const FOREVER: u32 = u32::MAX;

/// One agent on one vertex, from one step to another, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Block {
    from: u32,
    to: u32,
    agent: u32,
}

/// The reservation table of a set of paths, which may conflict with each other.
///
/// A path holds the vertex after each step; its first vertex is that of step 0.
#[derive(Clone, Debug, Default)]
pub struct Reservations {
    /// For each vertex, its reservations, ordered by first step.
    blocks: Vec<Vec<Block>>,
}

impl Reservations {
    /// Creates an empty table for a number of vertices.
    pub fn new(num_vertices: usize) -> Self {
        Self { blocks: vec![Vec::new(); num_vertices] }
    }

    /// Removes all reservations.
    pub fn clear(&mut self) {
        self.blocks.iter_mut().for_each(Vec::clear);
    }

    /// Reserves the path of an agent. If the agent stays, its last vertex is reserved forever.
    pub fn add(&mut self, agent: usize, path: &[Vertex], stays: bool) {
        for (vertex, from, to) in runs(path, stays) {
            self.block(vertex, from, to, agent);
        }
    }

    /// Removes what [`Reservations::add`] reserved for the same path.
    pub fn remove(&mut self, agent: usize, path: &[Vertex], stays: bool) {
        for (vertex, from, to) in runs(path, stays) {
            self.unblock(vertex, from, to, agent);
        }
    }

    /// Reserves a vertex from one step to another, both included.
    pub fn block(&mut self, vertex: Vertex, from: u32, to: u32, agent: usize) {
        let blocks = &mut self.blocks[vertex as usize];
        let at = blocks.partition_point(|block| block.from <= from);
        blocks.insert(at, Block { from, to, agent: agent as u32 });
    }

    /// Removes what [`Reservations::block`] reserved.
    pub fn unblock(&mut self, vertex: Vertex, from: u32, to: u32, agent: usize) {
        let gone = Block { from, to, agent: agent as u32 };
        let blocks = &mut self.blocks[vertex as usize];
        if let Some(at) = blocks.iter().position(|&block| block == gone) {
            blocks.remove(at);
        }
    }

    /// Returns the safe interval of a vertex that contains a step, or else the next one; both ends are included.
    pub(crate) fn free_after(&self, vertex: Vertex, step: u32) -> Option<(u32, u32)> {
        let mut since = 0;
        for block in &self.blocks[vertex as usize] {
            if block.from > since && block.from > step {
                return Some((since, block.from - 1));
            }
            if block.to == FOREVER {
                return None;
            }
            since = since.max(block.to + 1);
        }
        Some((since, FOREVER))
    }

    /// Returns the number of edge conflicts of a move: reserved paths that move from `to` to `from` in the step that
    /// ends at `step`.
    pub(crate) fn num_swaps(&self, from: Vertex, to: Vertex, step: u32) -> u32 {
        let leaves = |block: &&Block| block.to.checked_add(1) == Some(step);
        let enters = |block: &Block, agent| block.from == step && block.agent == agent;
        let leaving = self.blocks[to as usize].iter().filter(leaves);
        let entering = &self.blocks[from as usize];
        leaving.filter(|left| entering.iter().any(|block| enters(block, left.agent))).count() as u32
    }

    /// Returns the number of reservations of a vertex at a step, and the last step up to which this number holds.
    pub(crate) fn count_at(&self, vertex: Vertex, step: u32) -> (u32, u32) {
        let (mut count, mut until) = (0, FOREVER);
        for block in &self.blocks[vertex as usize] {
            if block.from > step {
                return (count, until.min(block.from - 1));
            }
            if block.to >= step {
                count += 1;
                until = until.min(block.to);
            }
        }
        (count, until)
    }

    /// Returns the number of reservations of a vertex that end after a step.
    pub(crate) fn num_after(&self, vertex: Vertex, step: u32) -> u32 {
        self.blocks[vertex as usize].iter().filter(|block| block.to > step).count() as u32
    }

    /// Returns the agents that hold a vertex at some step of an interval.
    pub(crate) fn holders(&self, vertex: Vertex, from: u32, to: u32) -> impl Iterator<Item = usize> + '_ {
        let overlaps = move |block: &&Block| block.from <= to && block.to >= from;
        self.blocks[vertex as usize].iter().filter(overlaps).map(|block| block.agent as usize)
    }
}

/// Splits a path into runs of one vertex, each with its first and last step.
fn runs(path: &[Vertex], stays: bool) -> impl Iterator<Item = (Vertex, u32, u32)> + '_ {
    let mut from = 0;
    path.chunk_by(|one, other| one == other).map(move |run| {
        let first = from;
        from += run.len();
        let is_last = from == path.len();
        (run[0], first as u32, if is_last && stays { FOREVER } else { from as u32 - 1 })
    })
}
