//! Small random problems, and checks that every planner must pass.

pub mod joint_oracle;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use pogema_core::{Cell, Map};
use pogema_planners::{Budget, Outcome, Plan, Planner, Problem, validate};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

pub fn cells(places: &[(u16, u16)]) -> Vec<Cell> {
    places.iter().map(|&(row, col)| Cell { row, col }).collect()
}

pub fn problem(rows: &[&str], starts: &[(u16, u16)], goals: &[(u16, u16)]) -> Problem {
    Problem::new(&Map::from_rows(rows).unwrap(), &cells(starts), &cells(goals)).unwrap()
}

/// A map, and the start and the goal of each agent.
#[derive(Clone, Debug)]
pub struct Case {
    pub map: Map,
    pub starts: Vec<Cell>,
    pub goals: Vec<Cell>,
}

impl Case {
    pub fn new(rows: &[&str], agents: &[[(u16, u16); 2]]) -> Self {
        let cell = |(row, col): (u16, u16)| Cell { row, col };
        Self {
            map: Map::from_rows(rows).unwrap(),
            starts: agents.iter().map(|agent| cell(agent[0])).collect(),
            goals: agents.iter().map(|agent| cell(agent[1])).collect(),
        }
    }

    /// Draws a map with an obstacle density of one fifth, and `num_agents` agents. If the map has fewer free cells,
    /// draws one agent for each free cell.
    pub fn random(rng: &mut Pcg64Mcg, height: usize, width: usize, num_agents: usize) -> Self {
        let obstacles = (0..height * width).map(|_| rng.next_u32().is_multiple_of(5)).collect();
        let map = Map::new(height, width, obstacles).unwrap();
        let free = || (0..height * width).map(|at| map.cell_at(at)).filter(|&cell| !map.is_obstacle(cell));
        let mut draw = || {
            let mut cells: Vec<Cell> = free().collect();
            for last in (1..cells.len()).rev() {
                cells.swap(last, rng.next_u32() as usize % (last + 1));
            }
            cells.truncate(num_agents);
            cells
        };
        let (starts, goals) = (draw(), draw());
        Self { map, starts, goals }
    }

    pub fn problem(&self) -> Problem {
        Problem::new(&self.map, &self.starts, &self.goals).unwrap()
    }

    /// Returns the plan of an outcome; checks that it is valid and costs at least the lower bound.
    pub fn check<'a>(&self, outcome: &'a Outcome) -> Option<&'a Plan> {
        let goals = outcome.solution().map(|_| &self.goals[..]);
        if let Outcome::Solved { plan, lower_bound } = outcome {
            assert!(*lower_bound <= plan.sum_of_costs() as u64, "{outcome} in {self:?}");
        }
        if let Some(plan) = outcome.best() {
            assert_eq!(validate(&self.map, &self.starts, goals, plan), Ok(()), "{self:?}");
        }
        outcome.solution()
    }
}

pub fn rng(seed: u64) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(seed)
}

/// Checks the outcomes of trivial and impossible problems.
pub fn check_degenerate_problems(planner: &mut dyn Planner) {
    let no_agents = Case::new(&[".."], &[]);
    assert_eq!(
        no_agents.check(&planner.plan(&no_agents.problem(), &Budget::default())).unwrap().sum_of_costs(),
        0
    );
    let on_goals = Case::new(&[".."], &[[(0, 0), (0, 0)], [(0, 1), (0, 1)]]);
    assert_eq!(
        on_goals.check(&planner.plan(&on_goals.problem(), &Budget::default())).unwrap().num_steps(),
        0
    );
    let apart = Case::new(&[".#."], &[[(0, 0), (0, 2)]]);
    let same_goal = Case::new(&["..."], &[[(0, 0), (0, 1)], [(0, 2), (0, 1)]]);
    let crowded = Case::new(&[".."], &[[(0, 0), (0, 1)], [(0, 1), (0, 0)], [(0, 0), (0, 0)]]);
    for case in [&apart, &same_goal, &crowded] {
        let outcome = planner.plan(&case.problem(), &Budget::default());
        assert!(matches!(outcome, Outcome::Impossible { .. }), "{outcome} in {case:?}");
    }
    let late = Case::new(&["....."], &[[(0, 0), (0, 4)]]);
    let outcome = planner.plan(&late.problem().within(3), &Budget::default());
    assert!(matches!(outcome, Outcome::Impossible { .. }), "{outcome}");
    assert!(planner.plan(&late.problem().within(4), &Budget::default()).solution().is_some());
}

/// Checks that a planner times out if its budget is spent, and that it finds no solution for an unsolvable problem.
pub fn check_spent_budgets(planner: &mut dyn Planner) {
    let case = Case::new(&["....", ".##.", "...."], &[[(0, 0), (2, 3)], [(2, 3), (0, 0)], [(0, 3), (2, 0)]]);
    let cancelled = Budget { cancelled: Some(Arc::new(AtomicBool::new(true))), ..Budget::default() };
    for budget in [Budget::of_nodes(0), Budget::of_time(Duration::ZERO), cancelled] {
        let outcome = planner.plan(&case.problem(), &budget);
        assert!(matches!(outcome, Outcome::TimedOut { .. }), "{outcome}");
        case.check(&outcome);
    }
    // The agents cannot pass each other.
    let stuck = Case::new(&["....."], &[[(0, 0), (0, 4)], [(0, 4), (0, 0)]]);
    let outcome = planner.plan(&stuck.problem(), &Budget::of_nodes(2000));
    assert!(outcome.solution().is_none(), "{outcome}");
    // In a full block, even a single joint state has too many successors to list.
    let cells: Vec<(u16, u16)> = (0..64).map(|index| (index / 8, index % 8)).collect();
    let goal = |index: usize| if index < 2 { cells[1 - index] } else { cells[index] };
    let agents: Vec<_> = (0..64).map(|index| [cells[index], goal(index)]).collect();
    let block = Case::new(&["........"; 8], &agents);
    let outcome = planner.plan(&block.problem(), &Budget::of_time(Duration::from_millis(50)));
    assert!(outcome.solution().is_none(), "{outcome}");
}

/// Checks that the same seed and budget give the same outcome.
pub fn check_repeats(mut make: impl FnMut() -> Box<dyn Planner>) {
    for seed in 0..20 {
        let case = Case::random(&mut rng(seed), 6, 6, 6);
        let one = make().plan(&case.problem(), &Budget::of_nodes(300));
        let other = make().plan(&case.problem(), &Budget::of_nodes(300));
        assert_eq!(one, other);
        case.check(&one);
    }
}
