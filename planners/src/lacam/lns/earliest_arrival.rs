//! SIPP for the LNS: the earliest arrival of one agent among the paths of others.
//!
//! Source: Phillips, Likhachev, "SIPP: Safe Interval Path Planning for Dynamic Environments", ICRA 2011.
//!
//! | paper | here |
//! | --- | --- |
//! | state: a vertex and a safe interval | [`Label`] |
//! | end of the safe interval | [`Label::until`] |
//! | g, f | [`Label::time`], the index of the bucket |

use crate::graph::{Graph, Vertex};
use crate::lacam::lns::time_table::{Path, TimeTable};

/// No label.
const NONE: u32 = u32::MAX;

/// A vertex, a safe interval and the earliest time in it.
#[derive(Clone, Copy, Debug)]
struct Label {
    vertex: Vertex,
    time: u32,
    until: u32,
    parent: u32,
}

/// The input of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Query<'a> {
    pub start: Vertex,
    pub goal: Vertex,
    pub costs: &'a [u32],
    /// The latest accepted arrival.
    pub latest: u32,
    /// Random bits that break ties.
    pub dice: u32,
}

/// The search, which reuses its memory.
#[derive(Debug)]
pub(crate) struct EarliestArrival {
    labels: Vec<Label>,
    /// Labels by f-value, relative to the f-value of the start.
    buckets: Vec<Vec<u32>>,
    num_vertices: usize,
    /// The earliest known time in each safe interval, as a rank: `epoch + span - 1 - time`. Ranks below `epoch` belong
    /// to earlier searches.
    ///
    /// Shape: `[span, vertices]`, by the start of the interval.
    best: Vec<u32>,
    epoch: u32,
    num_expanded: u64,
}

impl EarliestArrival {
    /// Returns the memory of searches, without their labels. Units: bytes.
    pub fn num_bytes(num_vertices: usize, span: usize) -> usize {
        num_vertices * span * size_of::<u32>()
    }

    /// Prepares searches for a number of vertices and a time span.
    pub fn new(num_vertices: usize, span: u32) -> Self {
        let best = vec![0; num_vertices * span as usize];
        Self { labels: Vec::new(), buckets: Vec::new(), num_vertices, best, epoch: 0, num_expanded: 0 }
    }

    /// Returns the number of labels expanded so far.
    pub fn num_expanded(&self) -> u64 {
        self.num_expanded
    }

    /// Writes the path of earliest arrival. Returns whether the agent arrives in time and can stay.
    pub fn find(&mut self, graph: &Graph, table: &TimeTable, query: Query<'_>, path: &mut Path) -> bool {
        let span = table.span();
        let base = query.costs[query.start as usize];
        let latest = query.latest.min(span - 1);
        if base > latest || table.is_busy(query.start, 0) {
            return false;
        }
        self.begin(span, (latest - base) as usize + 1);
        let until = table.next_busy(query.start, 0) - 1;
        self.push(0, Label { vertex: query.start, time: 0, until, parent: NONE });
        let mut bucket = 0;
        while bucket <= (latest - base) as usize {
            let Some(index) = self.buckets[bucket].pop() else {
                bucket += 1;
                continue;
            };
            let label = self.labels[index as usize];
            if label.vertex == query.goal && label.until + 1 == span {
                self.trace(index, path);
                return true;
            }
            self.expand(graph, table, query, index);
        }
        false
    }

    /// Resets the memory for a new search.
    fn begin(&mut self, span: u32, num_buckets: usize) {
        self.labels.clear();
        self.buckets.iter_mut().for_each(Vec::clear);
        if self.buckets.len() < num_buckets {
            self.buckets.resize_with(num_buckets, Vec::new);
        }
        // The ranks of the new search go up to `epoch + span - 1`.
        let next = self.epoch.checked_add(span).filter(|epoch| epoch.checked_add(span).is_some());
        self.epoch = next.unwrap_or_else(|| {
            self.best.fill(0);
            span
        });
    }

    fn push(&mut self, bucket: usize, label: Label) {
        self.buckets[bucket].push(self.labels.len() as u32);
        self.labels.push(label);
    }

    /// Expands a label, with the neighbours in an order that depends on `dice`.
    fn expand(&mut self, graph: &Graph, table: &TimeTable, query: Query<'_>, index: u32) {
        self.num_expanded += 1;
        let label = self.labels[index as usize];
        let around = graph.neighbours(label.vertex);
        let turn = query.dice.rotate_left(index % 32) as usize;
        for slot in 0..4 {
            if let Some(&vertex) = around.get((slot + turn) % 4) {
                self.reach(table, query, (index, label), vertex);
            }
        }
    }

    /// Generates a label for each reachable safe interval of a neighbour.
    #[inline]
    fn reach(&mut self, table: &TimeTable, query: Query<'_>, (parent, label): (u32, Label), vertex: Vertex) {
        let span = table.span();
        let ahead = query.costs[vertex as usize];
        let latest = query.latest.min(span - 1);
        if label.time + 1 + ahead > latest {
            return;
        }
        let mut since = table.free_since_or_next(vertex, label.time + 1);
        while since <= label.until + 1 && since < span {
            let time = since.max(label.time + 1);
            if time + ahead > latest {
                return;
            }
            let end = table.next_busy(vertex, time);
            let is_swap = time == since && table.is_swap(label.vertex, vertex, time);
            let best = &mut self.best[since as usize * self.num_vertices + vertex as usize];
            let rank = self.epoch + (span - 1 - time);
            if !is_swap && *best < rank {
                *best = rank;
                let bucket = (time + ahead - query.costs[query.start as usize]) as usize;
                self.push(bucket, Label { vertex, time, until: end - 1, parent });
            }
            since = table.next_free(vertex, end);
        }
    }

    /// Writes the path that ends with a label.
    fn trace(&self, index: u32, path: &mut Path) {
        path.clear();
        let end = self.labels[index as usize];
        path.resize(end.time as usize + 1, end.vertex);
        let (mut index, mut until) = (index, path.len());
        while index != NONE {
            let label = self.labels[index as usize];
            path[label.time as usize..until].fill(label.vertex);
            (index, until) = (label.parent, label.time as usize);
        }
    }
}
