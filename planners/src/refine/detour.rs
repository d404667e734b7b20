//! The earliest arrival of one agent among the paths of others: A* over safe intervals.
//!
//! Paper: Phillips, Likhachev, "SIPP: Safe Interval Path Planning for Dynamic Environments", ICRA 2011.
//!
//! | here | there |
//! | --- | --- |
//! | `Label` | a state: a vertex and a safe interval, with the earliest time there |
//! | `Label::until` | the end of the safe interval |
//! | `Label::time`, the bucket's number | g, f |

use crate::graph::{Graph, Vertex};
use crate::refine::reservations::{Path, Reservations};

/// No label.
const NONE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Label {
    vertex: Vertex,
    time: u32,
    until: u32,
    parent: u32,
}

/// What is asked of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trip<'a> {
    pub start: Vertex,
    pub goal: Vertex,
    pub costs: &'a [u32],
    /// The latest arrival that is of use.
    pub latest: u32,
    /// Breaks ties.
    pub dice: u32,
}

/// Searches, and keeps the room that takes.
#[derive(Debug)]
pub(crate) struct Detours {
    labels: Vec<Label>,
    /// Labels by the arrival they promise, counted from that of the start.
    buckets: Vec<Vec<u32>>,
    num_vertices: usize,
    /// For each start of an interval and vertex, the best time there, counted down from `epoch`.
    best: Vec<u32>,
    epoch: u32,
    num_expanded: u64,
}

impl Detours {
    /// Bytes that searches take for so many vertices and times.
    pub fn bytes(num_vertices: usize, span: usize) -> usize {
        num_vertices * span * size_of::<u32>()
    }

    /// For so many vertices and times.
    pub fn new(num_vertices: usize, span: u32) -> Self {
        let best = vec![0; num_vertices * span as usize];
        Self { labels: Vec::new(), buckets: Vec::new(), num_vertices, best, epoch: 0, num_expanded: 0 }
    }

    /// Labels expanded so far.
    pub fn num_expanded(&self) -> u64 {
        self.num_expanded
    }

    /// A path of earliest arrival, if one arrives in time to stay.
    pub fn find(&mut self, graph: &Graph, taken: &Reservations, trip: Trip<'_>, path: &mut Path) -> bool {
        let span = taken.span();
        let base = trip.costs[trip.start as usize];
        let latest = trip.latest.min(span - 1);
        if base > latest || taken.is_busy(trip.start, 0) {
            return false;
        }
        self.begin(span, (latest - base) as usize + 1);
        let until = taken.next_busy(trip.start, 0) - 1;
        self.push(0, Label { vertex: trip.start, time: 0, until, parent: NONE });
        let mut bucket = 0;
        while bucket <= (latest - base) as usize {
            let Some(index) = self.buckets[bucket].pop() else {
                bucket += 1;
                continue;
            };
            let label = self.labels[index as usize];
            if label.vertex == trip.goal && label.until + 1 == span {
                self.trace(index, path);
                return true;
            }
            self.expand(graph, taken, trip, index);
        }
        false
    }

    fn begin(&mut self, span: u32, num_buckets: usize) {
        self.labels.clear();
        self.buckets.iter_mut().for_each(Vec::clear);
        if self.buckets.len() < num_buckets {
            self.buckets.resize_with(num_buckets, Vec::new);
        }
        self.epoch = self.epoch.checked_add(span).unwrap_or_else(|| {
            self.best.fill(0);
            span
        });
    }

    fn push(&mut self, bucket: usize, label: Label) {
        self.buckets[bucket].push(self.labels.len() as u32);
        self.labels.push(label);
    }

    fn expand(&mut self, graph: &Graph, taken: &Reservations, trip: Trip<'_>, index: u32) {
        self.num_expanded += 1;
        let label = self.labels[index as usize];
        let around = graph.neighbours(label.vertex);
        let turn = trip.dice.rotate_left(index % 32) as usize;
        for slot in 0..4 {
            if let Some(&vertex) = around.get((slot + turn) % 4) {
                self.reach(taken, trip, (index, label), vertex);
            }
        }
    }

    /// Makes a label for each safe interval of a neighbour that can be reached.
    #[inline]
    fn reach(&mut self, taken: &Reservations, trip: Trip<'_>, (parent, label): (u32, Label), vertex: Vertex) {
        let span = taken.span();
        let ahead = trip.costs[vertex as usize];
        let latest = trip.latest.min(span - 1);
        if label.time + 1 + ahead > latest {
            return;
        }
        let mut since = taken.free_since_or_next(vertex, label.time + 1);
        while since <= label.until + 1 && since < span {
            let time = since.max(label.time + 1);
            if time + ahead > latest {
                return;
            }
            let end = taken.next_busy(vertex, time);
            let is_met = time == since && taken.is_met(label.vertex, vertex, time);
            let best = &mut self.best[since as usize * self.num_vertices + vertex as usize];
            let rank = self.epoch + (span - 1 - time);
            if !is_met && *best < rank {
                *best = rank;
                let bucket = (time + ahead - trip.costs[trip.start as usize]) as usize;
                self.push(bucket, Label { vertex, time, until: end - 1, parent });
            }
            since = taken.next_free(vertex, end);
        }
    }

    /// Writes the path that led to a label.
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
