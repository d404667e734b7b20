//! The static cost of each cell: high where shortest paths meet.

use pogema_planners::{Graph, Vertex};

/// The side of the tiles by which the sources of the searches are ordered. Units: cells.
const TILE: u16 = 8;

/// Returns the static cost of entering each vertex: the largest of all mean distances, divided by the mean distance of
/// the vertex.
///
/// The mean distance is that to all other vertices of the component. In a component of one vertex, the cost is NaN;
/// no agent can enter it.
///
/// Source: Follower, `follower_cpp/planner.h`
pub(crate) fn static_costs(graph: &Graph) -> Vec<f32> {
    let mut means = mean_distances(graph);
    // The largest number; `max` ignores NaN.
    let largest = means.iter().copied().fold(f32::NAN, f32::max);
    for mean in &mut means {
        *mean = largest / *mean;
    }
    means
}

/// Returns the mean distance of each vertex to the others of its component.
fn mean_distances(graph: &Graph) -> Vec<f32> {
    let mut sums = vec![(0_u64, 0_u64); graph.num_vertices()];
    let mut search = Search::new(graph.num_vertices());
    // Searches from cells that are near to each other reach a cell in almost the same rounds.
    let mut order: Vec<Vertex> = (0..graph.num_vertices() as Vertex).collect();
    order.sort_by_key(|&vertex| {
        let cell = graph.cell(vertex);
        (cell.row / TILE, cell.col / TILE)
    });
    for sources in order.chunks(u64::BITS as usize) {
        search.add_distances(graph, sources, &mut sums);
    }
    sums.into_iter().map(|(sum, count)| sum as f32 / count as f32).collect()
}

/// Breadth-first searches from up to 64 vertices in parallel, one bit for each.
struct Search {
    /// The searches that have reached each vertex, and those that reach it in this round and in the next.
    reached: Vec<u64>,
    arriving: Vec<u64>,
    next: Vec<u64>,
    frontier: Vec<Vertex>,
}

impl Search {
    fn new(num_vertices: usize) -> Self {
        let blank = || vec![0; num_vertices];
        Self { reached: blank(), arriving: blank(), next: blank(), frontier: Vec::new() }
    }

    /// Adds to each vertex the distances to at most 64 others, and their number. Distances are the same in both
    /// directions.
    fn add_distances(&mut self, graph: &Graph, sources: &[Vertex], sums: &mut [(u64, u64)]) {
        self.reached.fill(0);
        for (bit, &vertex) in sources.iter().enumerate() {
            self.reached[vertex as usize] = 1 << bit;
            self.arriving[vertex as usize] = 1 << bit;
            self.frontier.push(vertex);
        }
        let (mut distance, mut reached_now) = (0, Vec::new());
        while !self.frontier.is_empty() {
            distance += 1;
            for vertex in self.frontier.drain(..) {
                let arriving = std::mem::take(&mut self.arriving[vertex as usize]);
                for &neighbour in graph.neighbours(vertex) {
                    let new = arriving & !self.reached[neighbour as usize];
                    let next = &mut self.next[neighbour as usize];
                    if new != 0 && *next == 0 {
                        reached_now.push(neighbour);
                    }
                    *next |= new;
                }
            }
            for &vertex in &reached_now {
                let new = std::mem::take(&mut self.next[vertex as usize]);
                self.reached[vertex as usize] |= new;
                self.arriving[vertex as usize] = new;
                let (sum, count) = &mut sums[vertex as usize];
                *sum += distance * u64::from(new.count_ones());
                *count += u64::from(new.count_ones());
            }
            std::mem::swap(&mut self.frontier, &mut reached_now);
        }
    }
}
