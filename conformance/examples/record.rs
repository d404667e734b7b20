//! Records what POGEMA 1.4.0 does, for `conformance/golden/pogema-1.4.0`.
//!
//! ```text
//! cargo run --release -p pogema-conformance --example record -- random 400
//! cargo run --release -p pogema-conformance --example record -- benchmark 01-random.yaml 02-mazes.yaml
//! ```
//!
//! `random` plays freshly drawn episodes. `benchmark` resets every map of toolbox map sets as the published
//! benchmark does, with seed 0, from 8 to 64 agents, in one-shot and in lifelong mode.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;

use pogema_conformance::golden::{self, GoldenRecording};
use pogema_conformance::{NamedEngine, Op, Oracle, Request, draw_request, find_oracle_python, play_script};
use pogema_core::Error;
use serde_json::json;

/// A seed that no other run uses by default.
const SEED: u64 = 1_400;
const CROWDS: [usize; 6] = [8, 16, 24, 32, 48, 64];

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let result = match words.split_first() {
        Some((what, [number])) if what == "random" => random(number),
        Some((what, files)) if what == "benchmark" && !files.is_empty() => benchmark(files),
        _ => Err(Error::Request { reason: "expected `random NUMBER` or `benchmark FILE...`".into() }),
    };
    match result {
        Ok(number) => {
            println!("recorded {number} requests");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn random(number: &str) -> Result<usize, Error> {
    let number: u64 =
        number.parse().map_err(|error| Error::Request { reason: format!("`{number}`: {error}") })?;
    let requests =
        (0..number).map(|case| play_script(NamedEngine::REFERENCE, draw_request(SEED, case), SEED).0);
    record("random.jsonl.zst", requests)
}

fn benchmark(files: &[String]) -> Result<usize, Error> {
    let mut requests = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(file).map_err(|error| Error::io(file, error))?;
        let maps: BTreeMap<String, String> =
            serde_saphyr::from_str(&text).map_err(|error| Error::io(file, error.to_string()))?;
        for map in maps.values() {
            for num_agents in CROWDS {
                for (on_target, max_steps) in [("nothing", 128), ("restart", 256)] {
                    requests.push(scenario(map, num_agents, on_target, max_steps));
                }
            }
        }
    }
    record("benchmark.jsonl.zst", requests.into_iter())
}

fn scenario(map: &str, num_agents: usize, on_target: &str, max_steps: usize) -> Request {
    let config = json!({
        "map": map,
        "num_agents": num_agents,
        "on_target": on_target,
        "max_episode_steps": max_steps,
        "seed": 0,
        "collision_system": "soft",
        // The places do not depend on how far agents see, and small windows keep the file small.
        "obs_radius": 1,
    });
    Request { id: 0, config, register: None, density: false, collisions: false, ops: vec![Op::Reset(None)] }
}

fn record(name: &str, requests: impl Iterator<Item = Request>) -> Result<usize, Error> {
    let python = find_oracle_python(Path::new("target/oracle"))?;
    let mut oracle = Oracle::start(&python)?;
    let mut recordings = Vec::new();
    for request in requests {
        let response = oracle.ask(&request)?;
        recordings.push(GoldenRecording { request, response });
    }
    golden::write(&golden::folder().join(name), &recordings)?;
    Ok(recordings.len())
}
