//! The best way of one agent past others, against a search through all cells and steps.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::common::{Case, rng};
use pogema_planners::sipp::{Horizon, Leg, Order, Sipp, Task};
use pogema_planners::{Distances, Graph, Reservations, UNREACHABLE, Vertex};
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

/// Steps after which nothing changes any more.
const LONGEST: usize = 40;

/// Others who wander about and in the end stay.
struct Others {
    paths: Vec<Vec<Vertex>>,
    stays: bool,
}

impl Others {
    fn random(rng: &mut Pcg64Mcg, graph: &Graph, count: usize, stays: bool) -> Self {
        let wander = |rng: &mut Pcg64Mcg| {
            let mut path = vec![rng.next_u32() % graph.num_vertices() as u32];
            for _ in 0..rng.next_u32() % 12 {
                let at = path[path.len() - 1];
                let around = graph.neighbours(at);
                let choice = rng.next_u32() as usize % (around.len() + 1);
                path.push(around.get(choice).copied().unwrap_or(at));
            }
            path
        };
        Self { paths: (0..count).map(|_| wander(rng)).collect(), stays }
    }

    fn reserved(&self, graph: &Graph) -> Reservations {
        let mut reserved = Reservations::new(graph.num_vertices());
        for (agent, path) in self.paths.iter().enumerate() {
            reserved.add(agent, path, self.stays);
        }
        reserved
    }

    fn at(&self, path: &[Vertex], step: usize) -> Option<Vertex> {
        path.get(step).or(path.last().filter(|_| self.stays)).copied()
    }

    /// Conflicts of a move that ends at a step; a move from nowhere is the start.
    fn conflicts(&self, from: Option<Vertex>, to: Vertex, step: usize) -> usize {
        let meets = |path: &&Vec<Vertex>| {
            let swaps = from.is_some_and(|from| {
                from != to && self.at(path, step - 1) == Some(to) && self.at(path, step) == Some(from)
            });
            self.at(path, step) == Some(to) || swaps
        };
        self.paths.iter().filter(meets).count()
    }
}

/// The least steps to the goal, or what they are in a window, by looking at all cells step by step.
fn least(graph: &Graph, start: Vertex, to_go: &[u32], others: &Others, window: Option<usize>) -> Option<u32> {
    // For each cell, whether the goal was reached before, and when.
    let mut now: HashMap<(Vertex, bool), u32> = HashMap::new();
    if others.conflicts(None, start, 0) > 0 {
        return None;
    }
    let reaches = |at: Vertex| window.is_some() && to_go[at as usize] == 0;
    now.insert((start, reaches(start)), 0);
    let mut best = None;
    for step in 0..=LONGEST {
        for (&(at, reached), &cost) in &now {
            let open_end = window == Some(step) && (reached || to_go[at as usize] != UNREACHABLE);
            let beyond = if reached { cost } else { step as u32 + to_go[at as usize].min(1 << 20) };
            let is_free = (step..LONGEST + 20).all(|step| others.conflicts(Some(at), at, step.max(1)) == 0);
            let parked = window.is_none() && to_go[at as usize] == 0 && is_free;
            if open_end || parked {
                best = Some(best.map_or(beyond, |best: u32| best.min(beyond)));
            }
        }
        if window == Some(step) || (window.is_none() && best.is_some()) {
            return best;
        }
        let mut next: HashMap<(Vertex, bool), u32> = HashMap::new();
        for (&(at, reached), &cost) in &now {
            for &to in graph.neighbours(at).iter().chain([&at]) {
                if others.conflicts(Some(at), to, step + 1) == 0 {
                    let arrives = !reached && reaches(to);
                    let cost = if arrives { step as u32 + 1 } else { cost };
                    let known = next.entry((to, reached || arrives)).or_insert(cost);
                    *known = cost.min(*known);
                }
            }
        }
        now = next;
    }
    best
}

fn check_way(graph: &Graph, others: &Others, start: Vertex, path: &[Vertex]) -> usize {
    assert_eq!(path[0], start);
    let mut met = HashSet::new();
    for (step, pair) in path.windows(2).enumerate() {
        assert!(pair[0] == pair[1] || graph.neighbours(pair[0]).contains(&pair[1]));
        if others.conflicts(Some(pair[0]), pair[1], step + 1) > 0 {
            met.insert(step);
        }
    }
    met.len()
}

fn check_against_all_steps(window: Option<usize>) {
    for seed in 0..1500 {
        let mut rng = rng(seed);
        let case = Case::random(&mut rng, 4, 5, 1);
        let graph = Arc::new(Graph::new(&case.map));
        let others = Others::random(&mut rng, &graph, (seed % 5) as usize, window.is_none() && seed % 2 == 0);
        let (start, goal) = (case.problem().starts[0], case.problem().goals[0]);
        let to_go = Distances::new(graph.clone(), 0).to(goal);
        let want = least(&graph, start, &to_go, &others, window);
        let reserved = others.reserved(&graph);
        let horizon = window.map_or(Horizon::Stay { max_steps: 60 }, |steps| Horizon::Window(steps as u32));
        let task = Task {
            start,
            legs: &[Leg::last(to_go)],
            reserved: &reserved,
            avoided: None,
            banned: &[],
            horizon,
            order: Order::Cost,
            salt: seed as u32,
        };
        let mut sipp = Sipp::new(graph.clone());
        let way = sipp.find(&task);
        let avoided = Others::random(&mut rng, &graph, 3, window.is_none()).reserved(&graph);
        let careful = sipp.find(&Task { avoided: Some(&avoided), ..task });
        assert_eq!(careful.map(|way| way.cost), want, "seed {seed}");
        assert_eq!(
            way.as_ref().map(|way| way.cost),
            want,
            "seed {seed}: {case:?} {way:?} {:?}",
            others.paths
        );
        if let Some(way) = way {
            assert_eq!(check_way(&graph, &others, start, &way.path), 0);
            assert!(window.is_none_or(|steps| way.path.len() == steps + 1));
        }
    }
}

#[test]
fn no_way_to_stay_is_shorter() {
    check_against_all_steps(None);
}

#[test]
fn no_way_through_a_window_is_better() {
    for steps in [1, 4, 9] {
        check_against_all_steps(Some(steps));
    }
}

#[test]
fn banned_moves_are_not_made() {
    let graph = Arc::new(Graph::new(&Case::new(&["...", "..."], &[]).map));
    let to_go = Distances::new(graph.clone(), 0).to(2);
    let reserved = Reservations::new(6);
    let legs = [Leg::last(to_go)];
    let mut task = Task {
        start: 0,
        legs: &legs,
        reserved: &reserved,
        avoided: None,
        banned: &[(0, 1, 1), (0, 3, 1)],
        horizon: Horizon::Stay { max_steps: u32::MAX },
        order: Order::Cost,
        salt: 0,
    };
    let mut sipp = Sipp::new(graph);
    assert_eq!(sipp.find(&task).unwrap().path, [0, 0, 1, 2]);
    task.horizon = Horizon::Stay { max_steps: 2 };
    assert_eq!(sipp.find(&task), None);
}

#[test]
fn what_should_be_avoided_is_if_the_cost_allows() {
    for seed in 0..500 {
        let mut rng = rng(seed);
        let case = Case::random(&mut rng, 4, 5, 1);
        let graph = Arc::new(Graph::new(&case.map));
        let others = Others::random(&mut rng, &graph, 4, true);
        let (start, goal) = (case.problem().starts[0], case.problem().goals[0]);
        let to_go = Distances::new(graph.clone(), 0).to(goal);
        let least = to_go[start as usize];
        if least == UNREACHABLE {
            continue;
        }
        let (reserved, avoided) = (Reservations::new(graph.num_vertices()), others.reserved(&graph));
        let mut sipp = Sipp::new(graph.clone());
        let legs = [Leg::last(to_go)];
        let mut fewest = u32::MAX;
        let task = Task {
            start,
            legs: &legs,
            reserved: &reserved,
            avoided: Some(&avoided),
            banned: &[],
            horizon: Horizon::Stay { max_steps: u32::MAX },
            order: Order::Cost,
            salt: 0,
        };
        assert_eq!(sipp.find(&task).unwrap().cost, least);
        for slack in 0..6 {
            let order = Order::Conflicts { max_cost: least + slack };
            let way = sipp.find(&Task { order, ..task }).unwrap();
            assert!(way.cost <= least + slack && way.cost >= least);
            assert_eq!(way.path.len() as u32, way.cost + 1);
            assert!(way.conflicts <= fewest, "seed {seed}");
            let met = check_way(&graph, &others, start, &way.path);
            assert!(met == 0 || way.conflicts > 0);
            fewest = way.conflicts;
        }
    }
}
