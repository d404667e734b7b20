//! Costs to go: the steps from every cell to a goal, without other agents.

use std::collections::HashMap;
use std::sync::Arc;

use crate::bfs::Bfs;
use crate::graph::{Graph, Vertex};

/// Steps from each vertex to one goal, or [`crate::UNREACHABLE`].
pub type CostToGo = Arc<[u32]>;

/// A cache of cost-to-go tables, one for each requested goal.
///
/// If one more table would exceed the byte budget, the cache first evicts the least recently used ones. Tables that a
/// caller still holds are never evicted, so they can exceed the budget.
#[derive(Debug)]
pub struct Distances {
    graph: Arc<Graph>,
    bfs: Bfs,
    tables: HashMap<Vertex, (CostToGo, u64)>,
    max_tables: usize,
    now: u64,
}

impl Distances {
    /// The default byte budget of the tables.
    pub const DEFAULT_BYTES: usize = 512 << 20;

    /// Creates an empty cache with a byte budget; it has room for at least one table.
    pub fn new(graph: Arc<Graph>, num_bytes: usize) -> Self {
        let table = size_of::<u32>() * graph.num_vertices().max(1);
        let (bfs, max_tables) = (Bfs::new(&graph), (num_bytes / table).max(1));
        Self { graph, bfs, tables: HashMap::new(), max_tables, now: 0 }
    }

    /// Returns the graph.
    pub fn graph(&self) -> &Arc<Graph> {
        &self.graph
    }

    /// Returns the costs to go to a goal.
    pub fn to(&mut self, goal: Vertex) -> CostToGo {
        self.now += 1;
        if let Some((table, used)) = self.tables.get_mut(&goal) {
            *used = self.now;
            return table.clone();
        }
        if self.tables.len() >= self.max_tables {
            self.evict();
        }
        let table: CostToGo = self.bfs.costs_to_go(goal).collect();
        self.tables.insert(goal, (table.clone(), self.now));
        table
    }

    /// Returns the costs to go to each of several goals.
    pub fn to_all(&mut self, goals: &[Vertex]) -> Vec<CostToGo> {
        goals.iter().map(|&goal| self.to(goal)).collect()
    }

    /// Returns the number of cached tables.
    pub fn num_tables(&self) -> usize {
        self.tables.len()
    }

    /// Evicts an eighth of the tables, not only one table, because each eviction scans the whole cache. The evicted
    /// tables are the least recently used ones that no caller holds.
    fn evict(&mut self) {
        let idle = |entry: &(&Vertex, &(CostToGo, u64))| Arc::strong_count(&entry.1.0) == 1;
        let mut ages: Vec<(u64, Vertex)> =
            self.tables.iter().filter(idle).map(|(&goal, &(_, used))| (used, goal)).collect();
        ages.sort_unstable();
        for (_, goal) in ages.into_iter().take(self.tables.len().div_ceil(8)) {
            self.tables.remove(&goal);
        }
    }
}
