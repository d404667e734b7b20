//! The memory of a constraint tree.

use crate::cbs::node::Node;
use crate::graph::Vertex;

/// An upper estimate of the memory of a constraint tree. Paths count until the search ends.
#[derive(Debug)]
pub(crate) struct MemoryUse {
    max_bytes: usize,
    num_bytes: usize,
}

impl MemoryUse {
    /// The default byte budget.
    pub(crate) const DEFAULT_BYTES: usize = 1 << 30;

    /// Creates a count with a byte budget.
    pub(crate) fn new(max_bytes: usize) -> Self {
        Self { max_bytes, num_bytes: 0 }
    }

    /// Returns whether the budget is exceeded.
    pub(crate) fn is_full(&self) -> bool {
        self.num_bytes > self.max_bytes
    }

    /// Counts bytes in addition to the nodes.
    pub(crate) fn add(&mut self, num_bytes: usize) {
        self.num_bytes += num_bytes;
    }

    /// Counts a node, and the paths that it does not share with its parent.
    pub(crate) fn add_node(&mut self, node: &Node) {
        let length = |agent: usize| node.paths.path(agent).len();
        let new = match &node.constraints {
            Some(list) => length(list.constraint.agent),
            None => (0..node.paths.num_agents()).map(length).sum(),
        };
        self.add(Self::own_bytes(node) + new * size_of::<Vertex>());
    }

    /// Removes a node, but not the data it shares with others.
    pub(crate) fn remove_node(&mut self, node: &Node) {
        self.num_bytes -= Self::own_bytes(node);
    }

    /// Returns the bytes of a node itself and of its entry in the search.
    fn own_bytes(node: &Node) -> usize {
        const OVERHEAD: usize = 256;
        OVERHEAD + node.paths.num_agents() * 4 * size_of::<usize>()
    }
}
