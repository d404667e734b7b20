//! Exact costs to go: how many steps lead from any cell to a goal, other agents left out.

use std::collections::HashMap;
use std::sync::Arc;

use crate::flood::Flood;
use crate::graph::{Graph, Vertex};

/// The cost from where no path leads to the goal.
pub const UNREACHABLE: u32 = u32::MAX;

/// Steps to one goal from each vertex, or [`UNREACHABLE`].
pub type CostToGo = Arc<[u32]>;

/// Costs to go for as many goals as are asked for, each searched once and shared.
///
/// Tables that nobody holds any more are dropped, those used longest ago first, once all together take more than
/// the budget; those still held are not counted against who holds them.
#[derive(Debug)]
pub struct Distances {
    graph: Arc<Graph>,
    flood: Flood,
    tables: HashMap<Vertex, (CostToGo, u64)>,
    most_tables: usize,
    now: u64,
}

impl Distances {
    /// Bytes that tables take unless another budget is chosen.
    pub const DEFAULT_BYTES: usize = 512 << 20;

    /// No costs yet, and room for tables of so many bytes, but for one at least.
    pub fn new(graph: Arc<Graph>, num_bytes: usize) -> Self {
        let table = size_of::<u32>() * graph.num_vertices().max(1);
        let (flood, most_tables) = (Flood::new(&graph), (num_bytes / table).max(1));
        Self { graph, flood, tables: HashMap::new(), most_tables, now: 0 }
    }

    /// The graph that is searched.
    pub fn graph(&self) -> &Arc<Graph> {
        &self.graph
    }

    /// The cost to go to a goal from every vertex.
    pub fn to(&mut self, goal: Vertex) -> CostToGo {
        self.now += 1;
        if let Some((table, used)) = self.tables.get_mut(&goal) {
            *used = self.now;
            return table.clone();
        }
        if self.tables.len() >= self.most_tables {
            self.drop_oldest();
        }
        let table: CostToGo = self.flood.costs_to_go(goal).collect();
        self.tables.insert(goal, (table.clone(), self.now));
        table
    }

    /// The costs to go of a goal for each agent.
    pub fn to_all(&mut self, goals: &[Vertex]) -> Vec<CostToGo> {
        goals.iter().map(|&goal| self.to(goal)).collect()
    }

    /// Number of tables kept.
    pub fn num_tables(&self) -> usize {
        self.tables.len()
    }

    /// Drops an eighth of the tables, those used longest ago, so that not every new one looks through all.
    fn drop_oldest(&mut self) {
        let idle = |entry: &(&Vertex, &(CostToGo, u64))| Arc::strong_count(&entry.1.0) == 1;
        let mut ages: Vec<(u64, Vertex)> =
            self.tables.iter().filter(idle).map(|(&goal, &(_, used))| (used, goal)).collect();
        ages.sort_unstable();
        for (_, goal) in ages.into_iter().take(self.tables.len().div_ceil(8)) {
            self.tables.remove(&goal);
        }
    }
}

/// The costs between all pairs of vertices, for small maps.
#[derive(Debug)]
pub struct AllPairs {
    num_vertices: usize,
    /// Row by row, one row for each goal.
    costs: Vec<u16>,
}

impl AllPairs {
    /// Most vertices of a map whose pairs are all kept, in 128 MiB.
    pub const MOST_VERTICES: usize = 8192;

    /// All costs of a graph, unless it has too many vertices.
    pub fn new(graph: &Graph) -> Option<Self> {
        let num_vertices = graph.num_vertices();
        if num_vertices > Self::MOST_VERTICES {
            return None;
        }
        let narrow = |cost: u32| u16::try_from(cost).unwrap_or(u16::MAX);
        let mut flood = Flood::new(graph);
        let mut costs = Vec::with_capacity(num_vertices * num_vertices);
        for goal in 0..num_vertices as Vertex {
            costs.extend(flood.costs_to_go(goal).map(narrow));
        }
        Some(Self { num_vertices, costs })
    }

    /// Steps from a vertex to a goal, or [`UNREACHABLE`].
    pub fn cost(&self, from: Vertex, goal: Vertex) -> u32 {
        match self.costs[goal as usize * self.num_vertices + from as usize] {
            u16::MAX => UNREACHABLE,
            cost => u32::from(cost),
        }
    }
}
