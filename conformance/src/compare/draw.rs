//! Text pictures of a difference.

use std::fmt::Write as _;

use pogema_core::{Cell, Map, picture};

use crate::digits::unpack;
use crate::request::{Record, Response};

/// Before, expected and got, below each other.
pub fn states(expected: &Response, got: &Response, op: usize) -> String {
    let map = expected.records[..=op].iter().rev().find_map(|record| match record {
        Record::Reset(reset) => Map::from_rows(&reset.map).ok(),
        _ => None,
    });
    let Some(map) = map else { return String::new() };
    let before = expected.records[..op].iter().rev().find_map(Record::state);
    let states =
        [("before", before), ("expected", expected.records[op].state()), ("got", got.records[op].state())];
    let mut text = String::new();
    for (what, state) in states {
        let Some(state) = state else { continue };
        let is_on_map = |cell: &Cell| map.contains(*cell);
        if ![&state.cells, &state.goals, &state.occupied].into_iter().flatten().all(is_on_map) {
            let _ = writeln!(text, "  {what}: somebody or something is off the map");
            continue;
        }
        let occupancy = picture::occupancy_picture(&map, state);
        let _ = writeln!(text, "  {what}: agents and goals, then occupancy");
        for (agents, occupied) in picture::picture(&map, state).lines().zip(occupancy.lines()) {
            let _ = writeln!(text, "    {agents}   {occupied}");
        }
    }
    text
}

/// Two windows of one agent below each other, channel by channel, or nothing where they are not of such a form.
pub fn windows(expected: &str, got: &str, side: usize) -> String {
    if got.contains(':') || expected.len() != got.len() {
        return String::new();
    }
    let (expected, got) = (unpack(expected), unpack(got));
    let area = side * side;
    let num_channels = expected.len() / area;
    let mut text = String::new();
    for (what, bits) in [("expected", &expected), ("got", &got)] {
        let names = if num_channels == 3 { ": obstacles, agents, goal" } else { "" };
        let _ = writeln!(text, "  {what}{names}");
        for row in 0..side {
            let line = |channel: usize| {
                let begin = channel * area + row * side;
                bits[begin..begin + side].iter().map(|&bit| if bit { '1' } else { '.' }).collect::<String>()
            };
            let lines: Vec<String> = (0..num_channels).map(line).collect();
            let _ = writeln!(text, "    {}", lines.join("   "));
        }
    }
    text
}

/// The place of the first value that differs, row by row.
pub fn first_differing_bit(one: &str, other: &str) -> usize {
    let digits = one.chars().zip(other.chars()).enumerate();
    let digit = |character: char| character.to_digit(16).unwrap_or(0);
    digits
        .map(|(index, (one, other))| (index, digit(one) ^ digit(other)))
        .find(|(_, difference)| *difference != 0)
        .map_or(4 * one.len().min(other.len()), |(index, difference)| {
            4 * index + difference.leading_zeros() as usize - 28
        })
}
