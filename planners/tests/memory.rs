//! The memory of planners for a thousand agents on a city map stays within the documented budgets.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::Arc;

use allocation_counter::measure;
use pogema_core::{Cell, Map};
use pogema_planners::{
    Budget, Distances, Graph, Lacam, LacamParams, Lifelong, PibtLifelong, PibtParams, Planner, Problem,
    validate,
};

const SIDE: usize = 256;
const NUM_AGENTS: usize = 1000;

/// Memory outside the cost tables and budgets: the graph, the plan, and the search data of each agent. Units: bytes.
const REST: usize = 32 << 20;

/// Returns a map of corridors two cells wide between walls, with a crossing in every seventh row.
fn city() -> Map {
    let is_wall = |index: usize| (index % SIDE).is_multiple_of(3) && !(index / SIDE).is_multiple_of(7);
    Map::new(SIDE, SIDE, (0..SIDE * SIDE).map(is_wall).collect()).unwrap()
}

/// Returns evenly spaced free cells, one for each agent, beginning with the free cell of index `first`.
fn some_cells(map: &Map, first: usize) -> Vec<Cell> {
    let free: Vec<Cell> =
        (0..SIDE * SIDE).map(|index| map.cell_at(index)).filter(|&cell| !map.is_obstacle(cell)).collect();
    let stride = free.len() / NUM_AGENTS;
    (0..NUM_AGENTS).map(|agent| free[(agent * stride + first) % free.len()]).collect()
}

#[test]
fn lacam_stays_within_its_byte_budget() {
    let map = city();
    let (starts, mut goals) = (some_cells(&map, 0), some_cells(&map, 9));
    goals.rotate_left(NUM_AGENTS / 20);
    let problem = Problem::new(&map, &starts, &goals).unwrap();
    let max_bytes = 24 << 20;
    let params = LacamParams { max_bytes, ..LacamParams::default() };
    let mut outcome = None;
    let memory = measure(|| outcome = Some(Lacam::new(params).plan(&problem, &Budget::of_nodes(3000))));
    validate(&map, &starts, Some(&goals), outcome.unwrap().solution().unwrap()).unwrap();
    let tables = 4 * NUM_AGENTS * problem.graph.num_vertices();
    let most = (tables + 2 * max_bytes + REST) as u64;
    assert!(memory.bytes_max <= most, "used {} bytes, expected at most {most}", memory.bytes_max);
    assert!(memory.bytes_max > tables as u64, "the measured memory is less than the cost tables");
}

#[test]
fn lifelong_pibt_bounds_its_distance_tables() {
    let map = city();
    let graph = Arc::new(Graph::new(&map));
    let mut cells = graph.vertices_of("start", &some_cells(&map, 0)).unwrap();
    let memory = measure(|| {
        let mut agents = PibtLifelong::new(graph.clone(), PibtParams::default());
        for round in 1..6 {
            let goals = graph.vertices_of("goal", &some_cells(&map, 3 * round)).unwrap();
            cells = agents.next(&cells, &goals, &Budget::default()).unwrap();
        }
    });
    let table = 4 * graph.num_vertices();
    // The tables of five rounds together exceed the limit.
    assert!(5 * NUM_AGENTS * table > Distances::DEFAULT_BYTES + NUM_AGENTS * table);
    let most = (Distances::DEFAULT_BYTES + REST) as u64;
    assert!(memory.bytes_max <= most, "used {} bytes, expected at most {most}", memory.bytes_max);
}
