//! Compares joint A* with an independent search through joint states, and tests the scenario statistics that use
//! joint A*.

use crate::common::joint_oracle::oracle;
use pogema_core::{Cell, Map, OnGoal};
use pogema_maps::{Infeasibility, PUZZLES, ScenarioStats};
use pogema_numpy::Generator;
use pogema_planners::{Solvability, solvability};

fn scenario(map: &Map, starts: &[Cell], goals: &[Cell], on_goal: OnGoal) -> ScenarioStats {
    ScenarioStats::of(map, starts, goals, on_goal, |part| {
        let max_states = ScenarioStats::MAX_STATES;
        solvability(&part.map, &part.starts, &part.goals, on_goal, max_states).unwrap().is_solvable()
    })
}

fn judge(rows: &[&str], agents: &[[(u16, u16); 2]], on_goal: OnGoal) -> ScenarioStats {
    let cells =
        |at: usize| -> Vec<Cell> { agents.iter().map(|ends| Cell::new(ends[at].0, ends[at].1)).collect() };
    scenario(&Map::from_rows(rows).unwrap(), &cells(0), &cells(1), on_goal)
}

fn verdict(rows: &[&str], agents: &[[(u16, u16); 2]], on_goal: OnGoal) -> Solvability {
    let map = Map::from_rows(rows).unwrap();
    let cell = |(row, col): (u16, u16)| Cell::new(row, col);
    let starts: Vec<Cell> = agents.iter().map(|[start, _]| cell(*start)).collect();
    let goals: Vec<Cell> = agents.iter().map(|[_, goal]| cell(*goal)).collect();
    let found = solvability(&map, &starts, &goals, on_goal, 1_000_000).unwrap();
    assert_eq!(found, oracle(&map, &starts, &goals, on_goal, 1_000_000));
    found
}

#[test]
fn two_agents_in_a_corridor_cannot_pass_unless_one_leaves() {
    let crossing = [[(0, 0), (0, 4)], [(0, 4), (0, 0)]];
    assert_eq!(verdict(&["....."], &crossing, OnGoal::Nothing), Solvability::Unsolvable);
    assert_eq!(verdict(&["....."], &crossing, OnGoal::Finish), Solvability::Unsolvable);
    // The second agent leaves the map before the first one passes its goal.
    let behind = [[(0, 0), (0, 4)], [(0, 2), (0, 1)]];
    assert_eq!(verdict(&["....."], &behind, OnGoal::Nothing), Solvability::Unsolvable);
    assert_eq!(verdict(&["....."], &behind, OnGoal::Finish), Solvability::Solvable { sum_of_costs: 6 });
}

#[test]
fn the_detour_into_a_bay_counts_as_cost() {
    let crossing = [[(0, 0), (0, 4)], [(0, 4), (0, 0)]];
    let bay = [".....", "##.##"];
    // One agent moves into the bay and out again.
    assert_eq!(verdict(&bay, &crossing, OnGoal::Nothing), Solvability::Solvable { sum_of_costs: 11 });
}

#[test]
fn a_full_ring_rotates_but_two_agents_cannot_swap() {
    let ring = [[(0, 0), (0, 1)], [(0, 1), (1, 1)], [(1, 1), (1, 0)], [(1, 0), (0, 0)]];
    assert_eq!(verdict(&["..", ".."], &ring, OnGoal::Nothing), Solvability::Solvable { sum_of_costs: 4 });
    let pair = [[(0, 0), (0, 1)], [(0, 1), (0, 0)]];
    assert_eq!(verdict(&[".."], &pair, OnGoal::Nothing), Solvability::Unsolvable);
    assert_eq!(verdict(&[".."], &pair, OnGoal::Finish), Solvability::Unsolvable);
}

#[test]
fn an_agent_leaves_its_goal_to_let_another_pass() {
    // The second agent starts on its goal, lets the first one pass and returns.
    let blocked = [[(0, 0), (0, 2)], [(0, 1), (0, 1)]];
    assert_eq!(
        verdict(&["...", "#.#"], &blocked, OnGoal::Nothing),
        Solvability::Solvable { sum_of_costs: 4 }
    );
}

#[test]
fn a_search_that_exceeds_its_state_limit_returns_unknown() {
    let rows = ["........"; 8];
    let agents: Vec<[(u16, u16); 2]> = (0..6).map(|at| [(0, at), (7, 7 - at)]).collect();
    let map = Map::from_rows(&rows).unwrap();
    let cells =
        |at: usize| -> Vec<Cell> { agents.iter().map(|ends| Cell::new(ends[at].0, ends[at].1)).collect() };
    let found = solvability(&map, &cells(0), &cells(1), OnGoal::Nothing, 1000);
    assert_eq!(found.unwrap(), Solvability::Unknown);
    // A single step of these agents has too many outcomes to list.
    let crowd: Vec<Cell> = (0..20).map(|index| map.cell_at(3 * index)).collect();
    let mut goals = crowd.clone();
    goals.rotate_left(1);
    let block: Vec<Cell> = (0..32).map(|index| map.cell_at(index)).collect();
    let half = Map::new(4, 8, vec![false; 32]).unwrap();
    for on_goal in [OnGoal::Nothing, OnGoal::Finish] {
        for (map, starts, goals) in [(&map, &crowd, &goals), (&map, &block, &block), (&half, &block, &block)]
        {
            assert_eq!(solvability(map, starts, goals, on_goal, 1000).unwrap(), Solvability::Unknown);
        }
    }
}

#[test]
fn two_agents_locked_in_a_small_component_are_reported() {
    // The top left corner is cut off from the rest of the map.
    let rows = ["..#...", ".##...", "##....", "......"];
    let agents = [[(0, 1), (1, 0)], [(1, 0), (0, 1)], [(3, 0), (0, 5)]];
    let stats = judge(&rows, &agents, OnGoal::Nothing);
    assert_eq!(stats.infeasibilities, [Infeasibility::WrongOrder(vec![0, 1])]);
    let stats = judge(&rows, &agents, OnGoal::Finish);
    assert_eq!(stats.infeasibilities, [Infeasibility::Locked(vec![0, 1])]);
    let square = ["..#", "..#"];
    let full = [[(0, 0), (0, 1)], [(0, 1), (0, 0)], [(1, 0), (1, 0)], [(1, 1), (1, 1)]];
    assert_eq!(
        judge(&square, &full, OnGoal::Nothing).infeasibilities,
        [Infeasibility::Locked(vec![0, 1, 2, 3])]
    );
}

#[test]
fn most_puzzles_are_proven_solvable() {
    let mut num_proven = 0;
    for puzzle in &PUZZLES {
        let text = puzzle.text().unwrap();
        let stats = scenario(&text.map, &text.starts, &text.goals.first(), OnGoal::Nothing);
        assert_eq!(stats.infeasibilities, [], "{}", puzzle.name);
        assert!(stats.sum_of_distances <= puzzle.sum_of_costs, "{}", puzzle.name);
        num_proven += usize::from(stats.is_proven_solvable);
    }
    assert!(num_proven > PUZZLES.len() / 2, "proved only {num_proven} puzzles");
}

#[test]
fn verdicts_agree_with_an_exhaustive_search() {
    let mut rng = Generator::seeded(5);
    let mut seen = [0; 2];
    for _ in 0..400 {
        let obstacles = (0..12).map(|_| rng.binomial1(0.35).unwrap()).collect();
        let map = Map::new(3, 4, obstacles).unwrap();
        let mut free: Vec<Cell> =
            (0..12).map(|at| map.cell_at(at)).filter(|&cell| !map.is_obstacle(cell)).collect();
        let num_agents = (free.len() / 2).min(3);
        rng.shuffle(&mut free);
        let starts = free[..num_agents].to_vec();
        rng.shuffle(&mut free);
        let goals = free[..num_agents].to_vec();
        for on_goal in [OnGoal::Nothing, OnGoal::Finish] {
            let found = scenario(&map, &starts, &goals, on_goal);
            let truth = oracle(&map, &starts, &goals, on_goal, usize::MAX);
            assert_eq!(solvability(&map, &starts, &goals, on_goal, usize::MAX).unwrap(), truth);
            let is_solvable = truth != Solvability::Unsolvable;
            assert_eq!(
                found.infeasibilities.is_empty(),
                is_solvable,
                "{map:?} {starts:?} {goals:?} {on_goal:?}"
            );
            assert_eq!(found.is_proven_solvable, is_solvable);
            seen[usize::from(is_solvable)] += 1;
        }
    }
    assert!(seen[0] > 100 && seen[1] > 100, "{seen:?}");
}

#[test]
fn puzzles_have_the_costs_of_the_catalogue() {
    assert!(PUZZLES.len() >= 20);
    for puzzle in &PUZZLES {
        let text = puzzle.text().unwrap();
        let found =
            solvability(&text.map, &text.starts, &text.goals.first(), OnGoal::Nothing, usize::MAX).unwrap();
        assert_eq!(found, Solvability::Solvable { sum_of_costs: puzzle.sum_of_costs }, "{}", puzzle.name);
    }
}
