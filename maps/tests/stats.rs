//! Figures of maps and scenarios, and what is proven of them.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{Cell, Map, OnGoal};
use pogema_maps::{Doubt, MapStats, PUZZLES, ScenarioStats, Verdict, search};
use pogema_numpy::Generator;

fn map(rows: &[&str]) -> Map {
    Map::from_rows(rows).unwrap()
}

fn judge(rows: &[&str], agents: &[[(u16, u16); 2]], on_goal: OnGoal) -> ScenarioStats {
    let cells =
        |at: usize| -> Vec<Cell> { agents.iter().map(|ends| Cell::new(ends[at].0, ends[at].1)).collect() };
    ScenarioStats::of(&map(rows), &cells(0), &cells(1), on_goal)
}

#[test]
fn a_map_by_its_figures() {
    let figures = MapStats::of(&map(&["...#.", ".#.#.", "...##", "#####", "..###"]));
    assert_eq!((figures.height, figures.width, figures.num_free), (5, 5, 12));
    assert_eq!(figures.density, 13.0 / 25.0);
    assert_eq!(figures.components, [8, 2, 2]);
    assert_eq!(figures.dead_ends, 4);
    assert_eq!(figures.corridor, 8);
    assert_eq!(figures.unreachable_pairs, 8 * 2 + 8 * 2 + 2 * 2);
    assert_eq!(figures.corridor_share(), 8.0 / 12.0);
    let full = MapStats::of(&map(&["##"]));
    assert_eq!((full.num_free, full.components.len(), full.corridor_share()), (0, 0, 0.0));
}

#[test]
fn no_way_to_the_goal() {
    let stats = judge(&["..#.."], &[[(0, 0), (0, 4)], [(0, 3), (0, 4)]], OnGoal::Finish);
    assert_eq!(stats.doubts, [Doubt::NoWay(0)]);
    assert!(!stats.is_proven_solvable);
    assert_eq!((stats.sum_of_distances, stats.longest_distance), (1, 1));
    // A start on an obstacle is in no component.
    assert_eq!(judge(&["#."], &[[(0, 0), (0, 1)]], OnGoal::Nothing).doubts, [Doubt::NoWay(0)]);
}

#[test]
fn one_cell_is_the_goal_of_two() {
    let agents = [[(0, 0), (0, 1)], [(0, 2), (0, 1)]];
    let together = judge(&["...", "..."], &agents, OnGoal::Nothing);
    assert!(together.doubts.contains(&Doubt::SameGoal(vec![0, 1], Cell::new(0, 1))));
    assert_eq!(judge(&["...", "..."], &agents, OnGoal::Finish).doubts, []);
}

#[test]
fn a_corridor_keeps_the_order_of_its_agents() {
    let row = ".".repeat(1000);
    let rows = [row.as_str()];
    let reversed = [[(0, 10), (0, 990)], [(0, 500), (0, 20)]];
    assert_eq!(judge(&rows, &reversed, OnGoal::Nothing).doubts, [Doubt::WrongOrder(vec![0, 1])]);
    let kept = [[(0, 10), (0, 20)], [(0, 500), (0, 990)]];
    assert_eq!(judge(&rows, &kept, OnGoal::Nothing).doubts, []);
    // A ring has no ends, so no order.
    let around = [[(0, 0), (0, 2)], [(0, 2), (0, 0)]];
    assert!(judge(&["...", ".#.", "..."], &around, OnGoal::Nothing).is_proven_solvable);
}

#[test]
fn a_pocket_in_which_two_are_locked() {
    // A street corner, cut off from the rest of the city.
    let rows = ["..#...", ".##...", "##....", "......"];
    let agents = [[(0, 1), (1, 0)], [(1, 0), (0, 1)], [(3, 0), (0, 5)]];
    let stats = judge(&rows, &agents, OnGoal::Nothing);
    assert_eq!(stats.doubts, [Doubt::WrongOrder(vec![0, 1])]);
    let stats = judge(&rows, &agents, OnGoal::Finish);
    assert_eq!(stats.doubts, [Doubt::Locked(vec![0, 1])]);
    let square = ["..#", "..#"];
    let full = [[(0, 0), (0, 1)], [(0, 1), (0, 0)], [(1, 0), (1, 0)], [(1, 1), (1, 1)]];
    assert_eq!(judge(&square, &full, OnGoal::Nothing).doubts, [Doubt::Locked(vec![0, 1, 2, 3])]);
}

#[test]
fn puzzles_are_proven_solvable_where_the_proof_is_cheap() {
    let mut num_proven = 0;
    for puzzle in &PUZZLES {
        let text = puzzle.text().unwrap();
        let stats = ScenarioStats::of(&text.map, &text.starts, &text.goals, OnGoal::Nothing);
        assert_eq!(stats.doubts, [], "{}", puzzle.name);
        assert!(stats.sum_of_distances <= puzzle.sum_of_costs, "{}", puzzle.name);
        num_proven += usize::from(stats.is_proven_solvable);
    }
    assert!(num_proven > PUZZLES.len() / 2, "only {num_proven}");
}

#[test]
fn what_is_proven_is_what_a_search_through_everything_finds() {
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
            let judged = ScenarioStats::of(&map, &starts, &goals, on_goal);
            let truth = search(&map, &starts, &goals, on_goal, usize::MAX);
            let is_solvable = truth != Verdict::Unsolvable;
            assert_eq!(judged.doubts.is_empty(), is_solvable, "{map:?} {starts:?} {goals:?} {on_goal:?}");
            assert_eq!(judged.is_proven_solvable, is_solvable);
            seen[usize::from(is_solvable)] += 1;
        }
    }
    assert!(seen[0] > 100 && seen[1] > 100, "{seen:?}");
}
