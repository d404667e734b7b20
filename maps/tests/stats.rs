//! Statistics of maps and scenarios, and proofs that scenarios cannot be solved.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{Cell, Map, OnGoal};
use pogema_maps::{Infeasibility, MapStats, ScenarioStats};

fn map(rows: &[&str]) -> Map {
    Map::from_rows(rows).unwrap()
}

fn judge(rows: &[&str], agents: &[[(u16, u16); 2]], on_goal: OnGoal) -> ScenarioStats {
    let cells =
        |at: usize| -> Vec<Cell> { agents.iter().map(|ends| Cell::new(ends[at].0, ends[at].1)).collect() };
    ScenarioStats::of(&map(rows), &cells(0), &cells(1), on_goal, |_| Some(true))
}

#[test]
fn statistics_of_a_map() {
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
fn unreachable_goals_are_infeasible() {
    let stats = judge(&["..#.."], &[[(0, 0), (0, 4)], [(0, 3), (0, 4)]], OnGoal::Finish);
    assert_eq!(stats.infeasibilities, [Infeasibility::NoPath(0)]);
    assert!(!stats.is_proven_solvable);
    assert_eq!((stats.sum_of_distances, stats.longest_distance), (1, 1));
    // A start on an obstacle is in no component.
    assert_eq!(
        judge(&["#."], &[[(0, 0), (0, 1)]], OnGoal::Nothing).infeasibilities,
        [Infeasibility::NoPath(0)]
    );
}

#[test]
fn shared_goals_are_infeasible_if_agents_stay() {
    let agents = [[(0, 0), (0, 1)], [(0, 2), (0, 1)]];
    let together = judge(&["...", "..."], &agents, OnGoal::Nothing);
    assert!(together.infeasibilities.contains(&Infeasibility::SameGoal(vec![0, 1], Cell::new(0, 1))));
    assert_eq!(judge(&["...", "..."], &agents, OnGoal::Finish).infeasibilities, []);
}

#[test]
fn agents_in_a_corridor_keep_their_order() {
    let row = ".".repeat(1000);
    let rows = [row.as_str()];
    let reversed = [[(0, 10), (0, 990)], [(0, 500), (0, 20)]];
    assert_eq!(
        judge(&rows, &reversed, OnGoal::Nothing).infeasibilities,
        [Infeasibility::WrongOrder(vec![0, 1])]
    );
    let kept = [[(0, 10), (0, 20)], [(0, 500), (0, 990)]];
    assert_eq!(judge(&rows, &kept, OnGoal::Nothing).infeasibilities, []);
    // A ring has no ends, so its agents have no fixed order.
    let around = [[(0, 0), (0, 2)], [(0, 2), (0, 0)]];
    assert!(judge(&["...", ".#.", "..."], &around, OnGoal::Nothing).is_proven_solvable);
}
