//! Records the answers of POGEMA 1.4.0 for `conformance/golden/pogema-1.4.0`.
//!
//! ```text
//! cargo run --release -p pogema-conformance --example record -- random 400
//! cargo run --release -p pogema-conformance --example record -- benchmark 01-random.yaml 02-mazes.yaml
//! ```
//!
//! `random NUMBER` plays that many random episodes. `benchmark FILE...` resets every map of the given toolbox map
//! sets as the published benchmark does: with seed 0, from 8 to 64 agents, in one-shot and in lifelong mode.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;

use pogema_conformance::golden::{self, GoldenRecording};
use pogema_conformance::{NamedEngine, Op, Oracle, Request, draw_request, find_oracle_python, play_script};
use pogema_core::Error;
use serde_json::json;

/// Differs from the default seeds of all other runs.
const SEED: u64 = 1_400;
const NUMS_AGENTS: [usize; 6] = [8, 16, 24, 32, 48, 64];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let result = match arguments.split_first() {
        Some((mode, [number])) if mode == "random" => random(number),
        Some((mode, files)) if mode == "benchmark" && !files.is_empty() => benchmark(files),
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
        number.parse().map_err(|_| Error::argument("NUMBER", number, "a number of episodes"))?;
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
            for num_agents in NUMS_AGENTS {
                for (on_target, max_steps) in [("nothing", 128), ("restart", 256)] {
                    requests.push(reset_request(map, num_agents, on_target, max_steps));
                }
            }
        }
    }
    record("benchmark.jsonl.zst", requests.into_iter())
}

fn reset_request(map: &str, num_agents: usize, on_target: &str, max_steps: usize) -> Request {
    let config = json!({
        "map": map,
        "num_agents": num_agents,
        "on_target": on_target,
        "max_episode_steps": max_steps,
        "seed": 0,
        "collision_system": "soft",
        // Starts and goals do not depend on the radius, and small windows keep the file small.
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
