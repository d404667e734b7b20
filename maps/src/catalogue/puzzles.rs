//! The puzzles of the catalogue.

use super::Puzzle;

/// Builds a table of puzzles. Each entry holds the name without `puzzle-`, the optimal sum of costs, the task, and the
/// rows of the map with the starts and with the goals.
macro_rules! puzzles {
    ($($name:literal, $sum_of_costs:literal, $task:literal: [$($starts:literal)+] => [$($goals:literal)+];)+) => {
        [$(Puzzle {
            name: concat!("puzzle-", $name),
            task: $task,
            starts: [$($starts),+],
            goals: [$($goals),+],
            sum_of_costs: $sum_of_costs,
        }),+]
    };
}

/// All puzzles. Each is solvable. Except in two rotations, agents must give way to each other.
pub const PUZZLES: [Puzzle; 26] = puzzles! {
    "passing-bay", 11, "One of two agents in a corridor steps into the bay and lets the other pass.":
        ["#####" "##.##" "a...b" "#####" "#####"] => ["#####" "##.##" "b...a" "#####" "#####"];
    "far-bay", 14, "The bay is far away, so both agents go there to change places and come back.":
        ["#####" "###.#" "ab..." "#####" "#####"] => ["#####" "###.#" "ba..." "#####" "#####"];
    "swap-in-dead-end", 10, "Two agents in a dead end change places at its mouth.":
        ["##a##" "##b##" "....." "#####" "#####"] => ["##b##" "##a##" "....." "#####" "#####"];
    "two-bays", 19, "The outer two of three agents in a corridor change places at two bays.":
        ["#####" "#.#.#" "ab.c." "#####" "#####"] => ["#####" "#.#.#" "cb.a." "#####" "#####"];
    "three-reversed", 27, "Three agents leave a corridor and come back in reverse order.":
        ["a####" "b#.##" "c...." "##.##" "#####"] => ["c####" "b#.##" "a...." "##.##" "#####"];
    "crossroads", 28, "Four agents cross one cell, each to the opposite arm.":
        ["##a##" "##.##" "b...d" "##.##" "##c##"] => ["##c##" "##.##" "d...b" "##.##" "##a##"];
    "full-ring", 8, "Eight agents fill a ring: it turns only if all of them move in the same step.":
        ["#####" "#abc#" "#h#d#" "#gfe#" "#####"] => ["#####" "#hab#" "#g#c#" "#fed#" "#####"];
    "square-turn", 4, "Four agents in a square rotate without a free cell.":
        ["#####" "#ab##" "#dc##" "#####" "#####"] => ["#####" "#da##" "#cb##" "#####" "#####"];
    "side-street", 17, "A side street two cells deep holds two agents while the third passes.":
        ["##.##" "##.##" "ab..c" "#####" "#####"] => ["##.##" "##.##" "cb..a" "#####" "#####"];
    "hostage", 7, "An agent that is already on its goal leaves it for another agent and comes back.":
        ["#####" "##.##" "a.b.." "#####" "#####"] => ["#####" "##.##" "..b.a" "#####" "#####"];
    "deep-hostage", 7, "An agent on its goal in a crossing leaves it for another agent and comes back.":
        ["#####" "##.##" "a.b.." "##.##" "#####"] => ["#####" "##.##" "..b.a" "##.##" "#####"];
    "revolving-door", 36, "Two agents enter a room through one door while two come out.":
        ["ab..." "....." "##.##" "....." "cd..."] => ["cd..." "....." "##.##" "....." "ab..."];
    "elevator", 19, "One agent waits in a bay between two shafts while the other passes.":
        ["a####" ".#.##" "....." "####." "####b"] => ["b####" ".#.##" "....." "####." "####a"];
    "comb", 27, "Three agents in the teeth of a comb change places in a cycle.":
        ["a#b#c" ".#.#." "....." "#####" "#####"] => ["c#a#b" ".#.#." "....." "#####" "#####"];
    "comb-reversed", 30, "Three agents in the teeth of a comb; the outer two change places past the middle.":
        ["a#b#c" "....." "#####" "#####" "#####"] => ["c#b#a" "....." "#####" "#####" "#####"];
    "shunting", 14, "Two agents in a siding change their order.":
        ["....." "##.##" "##a##" "##b##" "#####"] => ["....." "##.##" "##b##" "##a##" "#####"];
    "three-shunted", 21, "Three agents in a siding change their order.":
        ["....." "##a##" "##b##" "##c##" "#####"] => ["....." "##c##" "##a##" "##b##" "#####"];
    "figure-eight", 17, "Two rings share one cell; an agent on each has its goal on the other.":
        ["a..##" ".#.##" "....." "##.#." "##..b"] => ["b..##" ".#.##" "....." "##.#." "##..a"];
    "tight-eight", 55, "Two rings share one cell, with three agents on each.":
        ["ab.##" "c#.##" "....." "##.#d" "##.ef"] => ["fe.##" "d#.##" "....." "##.#c" "##.ba"];
    "lobby", 24, "Three agents in single file give way to a fourth, which enters their row.":
        ["#####" ".abc." "##.##" "##d##" "#####"] => ["#####" "d.abc" "##.##" "##.##" "#####"];
    "bottleneck", 26, "Two agents need the same passage, and a third crosses its end.":
        ["a###b" "..#.." "#...#" "..#.." "c###."] => ["c###." "..#.." "#...#" "..#.." "b###a"];
    "double-shunt", 28, "Two pairs of agents change their order, one at a junction, the other on a ring.":
        ["a#..c" "b#.#d" "....." "#####" "#####"] => ["b#..d" "a#.#c" "....." "#####" "#####"];
    "guarded-gate", 7, "One of two agents on their goals gives way to a third and comes back.":
        ["##.##" "a.b.." "##c##" "##.##" "#####"] => ["##.##" "..b.a" "##c##" "##.##" "#####"];
    "parade", 36, "Three agents in a row reverse their order, with bays at both ends.":
        ["#####" ".###." "abc.." ".###." "#####"] => ["#####" ".###." "cba.." ".###." "#####"];
    "long-way-round", 16, "The short way is occupied, so one of two agents takes the long way.":
        ["a...b" ".###." ".###." ".###." "....."] => ["b...a" ".###." ".###." ".###." "....."];
    "last-cell", 17, "Five agents and one free cell: three of them change places.":
        ["#####" "#####" "#abc#" "#d.e#" "#####"] => ["#####" "#####" "#cab#" "#d.e#" "#####"];
};
