//! SIPP against a search through all cells and steps.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::common::{Case, rng};
use pogema_planners::sipp::{Horizon, Leg, Order, Sipp, Task};
use pogema_planners::{Distances, Graph, Reservations, UNREACHABLE, Vertex};
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

/// The number of steps after which the other agents no longer move.
const LAST_CHANGE: usize = 40;

/// Other agents, which follow random walks and may stay at their ends.
struct Others {
    paths: Vec<Vec<Vertex>>,
    stays: bool,
}

impl Others {
    fn random(rng: &mut Pcg64Mcg, graph: &Graph, count: usize, stays: bool) -> Self {
        let random_walk = |rng: &mut Pcg64Mcg| {
            let mut path = vec![rng.next_u32() % graph.num_vertices() as u32];
            for _ in 0..rng.next_u32() % 12 {
                let at = path[path.len() - 1];
                let around = graph.neighbours(at);
                let choice = rng.next_u32() as usize % (around.len() + 1);
                path.push(around.get(choice).copied().unwrap_or(at));
            }
            path
        };
        Self { paths: (0..count).map(|_| random_walk(rng)).collect(), stays }
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

    /// Counts the conflicts of a move that ends at a step; without `from`, the agent starts at `to`.
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

/// Returns the least cost of a path to the goal, or of a path within a window, by searching all cells step by step.
fn least_cost(
    graph: &Graph,
    start: Vertex,
    to_go: &[u32],
    others: &Others,
    window: Option<usize>,
) -> Option<u32> {
    // The keys are cells and whether the agent has reached the goal; the values are the steps at which it did.
    let mut now: HashMap<(Vertex, bool), u32> = HashMap::new();
    if others.conflicts(None, start, 0) > 0 {
        return None;
    }
    let reaches = |at: Vertex| window.is_some() && to_go[at as usize] == 0;
    now.insert((start, reaches(start)), 0);
    let mut best = None;
    for step in 0..=LAST_CHANGE {
        for (&(at, reached), &cost) in &now {
            let open_end = window == Some(step) && (reached || to_go[at as usize] != UNREACHABLE);
            let beyond = if reached { cost } else { step as u32 + to_go[at as usize].min(1 << 20) };
            let is_free =
                (step..LAST_CHANGE + 20).all(|step| others.conflicts(Some(at), at, step.max(1)) == 0);
            let can_stay = window.is_none() && to_go[at as usize] == 0 && is_free;
            if open_end || can_stay {
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

/// Checks that a path is connected, and returns the number of its moves with conflicts.
fn check_path(graph: &Graph, others: &Others, start: Vertex, path: &[Vertex]) -> usize {
    assert_eq!(path[0], start);
    let mut conflict_steps = HashSet::new();
    for (step, pair) in path.windows(2).enumerate() {
        assert!(pair[0] == pair[1] || graph.neighbours(pair[0]).contains(&pair[1]));
        if others.conflicts(Some(pair[0]), pair[1], step + 1) > 0 {
            conflict_steps.insert(step);
        }
    }
    conflict_steps.len()
}

fn check_against_full_search(window: Option<usize>) {
    for seed in 0..1500 {
        let mut rng = rng(seed);
        let case = Case::random(&mut rng, 4, 5, 1);
        let graph = Arc::new(Graph::new(&case.map));
        let others = Others::random(&mut rng, &graph, (seed % 5) as usize, window.is_none() && seed % 2 == 0);
        let (start, goal) = (case.problem().starts[0], case.problem().goals[0]);
        let to_go = Distances::new(graph.clone(), 0).to(goal);
        let expected = least_cost(&graph, start, &to_go, &others, window);
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
        let found = sipp.find(&task);
        let avoided = Others::random(&mut rng, &graph, 3, window.is_none()).reserved(&graph);
        let with_soft_constraints = sipp.find(&Task { avoided: Some(&avoided), ..task });
        assert_eq!(with_soft_constraints.map(|found| found.cost), expected, "seed {seed}");
        assert_eq!(
            found.as_ref().map(|found| found.cost),
            expected,
            "seed {seed}: {case:?} {found:?} {:?}",
            others.paths
        );
        if let Some(found) = found {
            assert_eq!(check_path(&graph, &others, start, &found.path), 0);
            assert!(window.is_none_or(|steps| found.path.len() == steps + 1));
        }
    }
}

#[test]
fn paths_to_a_goal_are_shortest() {
    check_against_full_search(None);
}

#[test]
fn paths_through_a_window_are_shortest() {
    for steps in [1, 4, 9] {
        check_against_full_search(Some(steps));
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
fn soft_constraints_are_avoided_within_the_cost_limit() {
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
            let found = sipp.find(&Task { order, ..task }).unwrap();
            assert!(found.cost <= least + slack && found.cost >= least);
            assert_eq!(found.path.len() as u32, found.cost + 1);
            assert!(found.conflicts <= fewest, "seed {seed}");
            let conflict_steps = check_path(&graph, &others, start, &found.path);
            assert!(conflict_steps == 0 || found.conflicts > 0);
            fewest = found.conflicts;
        }
    }
}
