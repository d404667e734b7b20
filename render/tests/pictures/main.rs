//! Compares pictures of every kind with the drawn episode.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "../common/mod.rs"]
mod common;
mod drawn;
mod ground;
mod moving;
mod numbers;
mod pixels;
mod rejected;
mod snapshots;
mod svg_facts;
mod text_frames;

use common::{Policy, config, trace};
use pogema_core::{Cell, Config, Instance, Map, Outside, Snapshot, Trace};

/// Plays an episode of POGEMA's A* from a config in YAML.
fn played(text: &str) -> Trace {
    trace(&config(text), Policy::AStar)
}

/// Returns a trace of one frame with a map and the cell and goal of each agent.
fn still(rows: &[&str], agents: &[([u16; 2], [u16; 2])]) -> Trace {
    let config = Config { num_agents: agents.len(), radius: 2, ..Config::default() };
    let empty = Instance::new(Map::from_rows(rows).unwrap(), Outside::Free, Vec::new(), Vec::new()).unwrap();
    let mut trace = Trace::still(config, &empty);
    // Set the state directly, because no instance allows some of these states.
    trace.start.state = Snapshot {
        cells: agents.iter().map(|&(cell, _)| Cell::from(cell)).collect(),
        goals: agents.iter().map(|&(_, goal)| Cell::from(goal)).collect(),
        active: vec![true; agents.len()],
        on_goal: vec![false; agents.len()],
        occupied: Vec::new(),
    };
    trace
}
