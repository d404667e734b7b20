//! No puzzle can be solved without making way.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeSet;

use pogema_maps::{PUZZLES, distances_to};

#[test]
fn no_agent_can_go_as_if_it_were_alone() {
    // Where all have to step at once, no way gets longer.
    let turns = ["puzzle-full-ring", "puzzle-square-turn"];
    for puzzle in PUZZLES.iter().filter(|puzzle| !turns.contains(&puzzle.name)) {
        let text = puzzle.text().unwrap();
        let ways = text.starts.iter().zip(&text.goals);
        let alone = |(&start, &goal)| u64::from(distances_to(&text.map, goal)[text.map.index(start)]);
        assert!(ways.map(alone).sum::<u64>() < puzzle.sum_of_costs, "{}", puzzle.name);
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
