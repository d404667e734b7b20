//! In every puzzle except two rotations, agents must give way to each other: the optimal cost exceeds the sum of
//! distances.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeSet;

use pogema_maps::{PUZZLES, distances_to};

#[test]
fn optimal_cost_exceeds_the_sum_of_distances() {
    // In these puzzles all agents move in the same step, and no path gets longer.
    let turns = ["puzzle-full-ring", "puzzle-square-turn"];
    for puzzle in PUZZLES.iter().filter(|puzzle| !turns.contains(&puzzle.name)) {
        let text = puzzle.text().unwrap();
        let agents = text.starts.iter().zip(text.goals.first());
        let distance = |(&start, goal)| u64::from(distances_to(&text.map, goal)[text.map.index(start)]);
        assert!(agents.map(distance).sum::<u64>() < puzzle.sum_of_costs, "{}", puzzle.name);
    }
}

#[test]
fn starts_and_goals_are_drawn_on_one_map() {
    let ground = |rows: &[&str; 5]| rows.map(|row| row.replace(|letter: char| letter != '#', "."));
    let letters = |rows: &[&str; 5]| -> BTreeSet<char> {
        rows.concat().chars().filter(char::is_ascii_lowercase).collect()
    };
    for puzzle in &PUZZLES {
        assert_eq!(ground(&puzzle.starts), ground(&puzzle.goals), "{}", puzzle.name);
        assert_eq!(letters(&puzzle.starts), letters(&puzzle.goals), "{}", puzzle.name);
        let names: BTreeSet<char> = ('a'..).take(letters(&puzzle.starts).len()).collect();
        assert_eq!(letters(&puzzle.starts), names, "{}", puzzle.name);
    }
}
