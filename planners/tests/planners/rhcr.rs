//! RHCR and goal forecasts. Every step of RHCR is valid, even after agents were displaced or the budget ran out.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use crate::common::{Case, rng};
use pogema_core::{Cell, GoalStream, Instance, Map, Outside, State};
use pogema_planners::{
    Budget, GoalForecast, Graph, Lifelong, Plan, Rhcr, RhcrParams, Vertex, WindowSolver, validate,
};
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

const SOLVERS: [WindowSolver; 3] = [WindowSolver::Lns, WindowSolver::Pbs, WindowSolver::Ecbs { weight: 1.5 }];

/// Agents that get a random goal whenever they reach one.
struct World {
    map: Map,
    graph: Arc<Graph>,
    now: Vec<Vertex>,
    /// For each agent, all its goals.
    goals: Vec<Vec<Vertex>>,
    /// For each agent, the number of goals it has reached.
    reached: Vec<usize>,
}

impl World {
    fn new(seed: u64, side: usize, num_agents: usize) -> Self {
        let mut rng = rng(seed);
        let case = Case::random(&mut rng, side, side, num_agents);
        let graph = Arc::new(Graph::new(&case.map));
        let now = graph.vertices_of("start", &case.starts).unwrap();
        let mut draw = || rng.next_u32() % graph.num_vertices() as u32;
        let goals: Vec<Vec<Vertex>> = now.iter().map(|_| (0..200).map(|_| draw()).collect()).collect();
        Self { map: case.map, reached: vec![0; now.len()], graph, now, goals }
    }

    fn current_goals(&self) -> Vec<Vertex> {
        self.goals.iter().zip(&self.reached).map(|(goals, &reached)| goals[reached]).collect()
    }

    fn advance(&mut self, next: Vec<Vertex>) {
        let cells = |vertices: &[Vertex]| vertices.iter().map(|&at| self.graph.cell(at)).collect::<Vec<_>>();
        let plan = Plan::new(vec![cells(&self.now), cells(&next)]).unwrap();
        assert_eq!(validate(&self.map, &cells(&self.now), None, &plan), Ok(()));
        self.now = next;
        for (agent, &at) in self.now.iter().enumerate() {
            self.reached[agent] += usize::from(at == self.goals[agent][self.reached[agent]]);
        }
    }

    fn num_reached(&self) -> usize {
        self.reached.iter().sum()
    }
}

fn params(solver: WindowSolver) -> RhcrParams {
    RhcrParams { solver, planning_window: 8, ..RhcrParams::default() }
}

fn displace(world: &mut World, rng: &mut Pcg64Mcg) {
    let num_vertices = world.graph.num_vertices() as u32;
    let (agent, to) = (rng.next_u32() as usize % world.now.len(), rng.next_u32() % num_vertices);
    if !world.now.contains(&to) {
        world.now[agent] = to;
    }
}

#[test]
fn every_step_is_valid_even_after_agents_were_displaced() {
    for (seed, solver) in (0..24).zip(SOLVERS.into_iter().cycle()) {
        let mut world = World::new(seed, 7, 4 + (seed % 12) as usize);
        let planning_window = [0, 1, 3, 8, 20][(seed % 5) as usize];
        let params = RhcrParams { planning_window, ..params(solver) };
        let mut planner = Rhcr::new(world.graph.clone(), params);
        let mut rng = rng(seed);
        for step in 0..60 {
            let goals = world.current_goals();
            let next = planner.next(&world.now, &goals, &Budget::of_nodes(100)).unwrap();
            world.advance(next);
            if step % 7 == 6 {
                displace(&mut world, &mut rng);
            }
        }
    }
}

#[test]
fn agents_reach_many_goals() {
    for solver in SOLVERS {
        let mut world = World::new(5, 10, 20);
        let mut planner = Rhcr::new(world.graph.clone(), params(solver));
        for _ in 0..100 {
            let goals = world.current_goals();
            let next = planner.next(&world.now, &goals, &Budget::of_nodes(200)).unwrap();
            world.advance(next);
        }
        assert!(world.num_reached() > 150, "{solver:?}: {}", world.num_reached());
    }
}

#[test]
fn future_goals_allow_a_longer_simulation_window() {
    for solver in SOLVERS {
        let mut world = World::new(5, 10, 20);
        let mut planner =
            Rhcr::new(world.graph.clone(), RhcrParams { simulation_window: 5, ..params(solver) });
        for _ in 0..100 {
            let ahead = |(goals, &reached): (&Vec<Vertex>, &usize)| goals[reached..].to_vec();
            let goals: Vec<Vec<Vertex>> = world.goals.iter().zip(&world.reached).map(ahead).collect();
            let next = planner.next_with_future_goals(&world.now, &goals, &Budget::of_nodes(200)).unwrap();
            world.advance(next);
        }
        assert!(world.num_reached() > 150, "{solver:?}: {}", world.num_reached());
    }
}

#[test]
fn the_same_seed_gives_the_same_steps_also_after_a_reset() {
    for solver in SOLVERS {
        let run = |planner: &mut Rhcr| {
            let mut world = World::new(3, 8, 12);
            for _ in 0..40 {
                let goals = world.current_goals();
                let next = planner.next(&world.now, &goals, &Budget::of_nodes(60)).unwrap();
                world.advance(next);
            }
            world.now
        };
        let graph = World::new(3, 8, 12).graph;
        let mut planner = Rhcr::new(graph.clone(), params(solver));
        let first = run(&mut planner);
        planner.reset();
        assert_eq!(run(&mut planner), first);
        assert_eq!(run(&mut Rhcr::new(graph, params(solver))), first);
    }
}

#[test]
fn agents_reach_goals_even_with_a_spent_budget() {
    for solver in SOLVERS {
        let cancelled = Budget { cancelled: Some(Arc::new(AtomicBool::new(true))), ..Budget::default() };
        for budget in [Budget::of_nodes(0), Budget::of_time(Duration::ZERO), cancelled] {
            let mut world = World::new(4, 8, 12);
            let mut planner = Rhcr::new(world.graph.clone(), params(solver));
            for _ in 0..40 {
                let goals = world.current_goals();
                let next = planner.next(&world.now, &goals, &budget).unwrap();
                world.advance(next);
            }
            assert!(world.num_reached() > 10, "{solver:?}: {}", world.num_reached());
        }
    }
}

#[test]
fn degenerate_problems_have_steps_or_errors() {
    for solver in SOLVERS {
        let graph = |rows: &[&str]| Arc::new(Graph::new(&Case::new(rows, &[]).map));
        let next = |rows: &[&str], now: &[Vertex], goals: &[Vertex]| {
            Rhcr::new(graph(rows), params(solver)).next(now, goals, &Budget::default())
        };
        assert!(next(&[".."], &[], &[]).unwrap().is_empty());
        assert_eq!(next(&[".#."], &[0], &[1]).unwrap(), [0]);
        assert_eq!(next(&[".."], &[0, 1], &[1, 0]).unwrap(), [0, 1]);
        assert_eq!(next(&["..."], &[0, 2], &[2, 2]).unwrap()[1], 2);
        let text = |now: &[Vertex], goals: &[Vertex]| next(&[".."], now, goals).unwrap_err().to_string();
        assert_eq!(text(&[0], &[]), "goals has length 0, expected 1");
        assert_eq!(text(&[0, 0], &[1, 1]), "instance: agent 1: it shares vertex 0 with agent 0");
        assert_eq!(text(&[2], &[0]), "instance: agent 0: position is vertex 2, expected a vertex below 2");
        assert_eq!(text(&[0], &[2]), "instance: agent 0: goal is vertex 2, expected a vertex below 2");
    }
}

#[test]
fn a_forecast_rejects_states_of_other_episodes() {
    let case = Case::new(&["..."], &[]);
    let starts = vec![Cell::new(0, 0), Cell::new(0, 1)];
    let goals = vec![GoalStream::single(Cell::new(0, 2)), GoalStream::single(Cell::new(0, 1))];
    let instance = Instance::new(case.map.clone(), Outside::Free, starts, goals).unwrap();
    let mut forecast = GoalForecast::new(&instance, 2);
    let cells = [Cell::new(0, 2), Cell::new(0, 1), Cell::new(0, 0)];
    let mut error = |step: u64, num_agents: usize| {
        let (cells, flags) = (&cells[..num_agents], &[true; 3][..num_agents]);
        let state = State { step, cells, goals: cells, active: flags, on_goal: flags };
        forecast.follow(state).unwrap_err().to_string()
    };
    assert_eq!(error(0, 3), "found a state of 3 agents, expected 2");
    assert_eq!(error(1, 2), "found the state of step 1, expected step 0 of the same episode");
}

#[test]
fn a_forecast_advances_only_with_its_episode() {
    let map = Case::new(&["..."], &[]).map;
    let (start, first, second) = (Cell::new(0, 0), Cell::new(0, 2), Cell::new(0, 1));
    let goals = vec![GoalStream::sequence(first, vec![first, second].into())];
    let instance = Instance::new(map, Outside::Free, vec![start], goals).unwrap();
    for num_goals in 1..4 {
        let mut forecast = GoalForecast::new(&instance, num_goals);
        let mut follow = |step: u64, goal: Cell, on_goal: &[bool]| {
            let state = State { step, cells: &[start], goals: &[goal], active: &[true], on_goal };
            forecast.follow(state).map_err(|error| error.to_string())?;
            Ok::<_, String>(forecast.goals(0).to_vec())
        };
        let wrong = Err("goal (0, 1) of agent 0 does not match its future goals, expected (0, 2)".to_owned());
        assert_eq!(follow(0, second, &[false]), wrong);
        assert_eq!(follow(0, first, &[]), Err("on_goal has length 0, expected 1".to_owned()));
        let all = [first, second, first, second];
        assert_eq!(follow(0, first, &[false]), Ok(all[..num_goals].to_vec()));
        assert_eq!(follow(1, second, &[false]), wrong);
        let again = Err("goal (0, 2) of agent 0 does not match its future goals, expected (0, 1)".to_owned());
        assert_eq!(follow(1, first, &[true]), again);
        assert_eq!(follow(1, second, &[true]).unwrap()[0], second);
    }
}
