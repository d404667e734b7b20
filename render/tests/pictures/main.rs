//! Every kind of picture, held against the episode it was drawn of.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "../common/mod.rs"]
mod common;
mod drawn;
mod ground;
mod moving;
mod pixels;
mod refused;
mod snapshots;
mod svg_facts;
mod text_frames;

use common::{Policy, config, trace};
use pogema_core::{Cell, Config, Map, Outside, Snapshot};
use pogema_render::Film;

/// The film of an episode of POGEMA's A*, from a YAML text.
fn film(text: &str) -> Film {
    Film::of(&trace(&config(text), Policy::AStar))
}

/// A film of one frame: a map, and for each agent its cell and its goal.
fn still(rows: &[&str], agents: &[([u16; 2], [u16; 2])]) -> Film {
    let start = Snapshot {
        step: 0,
        cells: agents.iter().map(|&(cell, _)| Cell::from(cell)).collect(),
        goals: agents.iter().map(|&(_, goal)| Cell::from(goal)).collect(),
        active: vec![true; agents.len()],
        on_goal: vec![false; agents.len()],
        occupied: Vec::new(),
    };
    Film {
        config: Config { num_agents: agents.len(), radius: 2, ..Config::default() },
        map: Map::from_rows(rows).unwrap(),
        outside: Outside::Free,
        start,
        steps: Vec::new(),
    }
}
