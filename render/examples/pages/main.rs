//! Makes the pages for the browser tests, and parses maps that the editor saved.
//!
//! `pages DIR` writes replay pages, the expected content of each that has steps, and the editor. `pages check FILE...`
//! parses each file as a map text (`.txt`, `.map`) or else as a config, and prints its content as one line of JSON.

mod play;

use std::path::Path;

use pogema_core::{Error, Trace};
use pogema_maps::{GridConfig, InstanceSource, MapText, parse_map_text};
use pogema_render::html;
use pogema_render::reverted_moves::{Blocker, RevertedMove, reverted_moves};
use serde_json::{Value, json};

fn main() -> Result<(), Error> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [check, files @ ..] if check == "check" => files.iter().try_for_each(|file| check_file(file)),
        [folder] => write_all(Path::new(folder)),
        _ => Err(Error::Request { reason: "expected `pages DIR` or `pages check FILE...`".into() }),
    }
}

/// Name, title, config, and the probability of a random action.
const EPISODES: [(&str, &str, &str, f64); 6] = [
    (
        "finish",
        "Four agents </title><script>alert(1)</script> & goals",
        "{size: 8, num_agents: 4, seed: 3, density: 0.2}",
        0.1,
    ),
    (
        "restart",
        "Eight lifelong agents",
        "{size: 12, num_agents: 8, seed: 1, density: 0.25, on_target: restart, collision_system: block_both}",
        0.15,
    ),
    (
        "soft",
        "A crowd under soft",
        "{size: 7, num_agents: 12, seed: 5, density: 0.1, on_target: restart, collision_system: soft, obs_radius: 2}",
        0.2,
    ),
    (
        "nothing",
        "All on their goals together",
        "{size: 6, num_agents: 5, seed: 2, density: 0.1, on_target: nothing, reward: shared, empty_outside: false}",
        0.1,
    ),
    (
        "on_goal",
        "An agent that starts on its goal",
        "{map: \"......\", agents_xy: [[0, 0], [0, 5]], targets_xy: [[0, 0], [0, 2]]}",
        0.0,
    ),
    (
        "large",
        "A thousand agents",
        "{size: 256, num_agents: 1000, seed: 7, density: 0.2, on_target: restart, max_episode_steps: 256, collision_system: soft}",
        0.1,
    ),
];

fn write_all(folder: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
    for (name, title, yaml, stray) in EPISODES {
        let trace = play::play(yaml, stray)?;
        write(&folder.join(format!("{name}.html")), &html::replay(&trace, title)?)?;
        write(&folder.join(format!("{name}.json")), &expected(&trace, title)?)?;
    }
    let mut empty = play::play("{size: 4, density: 0, seed: 1}", 0.0)?;
    empty.steps.clear();
    write(&folder.join("empty.html"), &html::replay(&empty, "Before the first step")?)?;
    write(&folder.join("editor.html"), &html::editor())
}

fn write(path: &Path, text: &str) -> Result<(), Error> {
    std::fs::write(path, text).map_err(|error| Error::io(path, error))
}

/// Returns what the page of a trace must show: its states, reverted moves and observations.
fn expected(trace: &Trace, title: &str) -> Result<String, Error> {
    let states: Vec<Value> =
        std::iter::once(json!(trace.start)).chain(trace.steps.iter().map(|step| json!(step))).collect();
    let (config, map) = (&trace.header.config, &trace.header.map);
    let mut before = &trace.start.state;
    let mut reasons = Vec::new();
    for step in &trace.steps {
        reasons.push(
            reverted_moves(config, map, before, &step.actions, &step.state)
                .into_iter()
                .map(to_json)
                .collect::<Value>(),
        );
        before = &step.state;
    }
    let observations = if config.num_agents > 100 { Vec::new() } else { play::observe(trace)? };
    let all = json!({
        "title": title, "config": config, "map": map, "states": states, "reverted": reasons, "observations": observations,
    });
    Ok(all.to_string())
}

fn to_json(reverted: RevertedMove) -> Value {
    let other = match reverted.blocker {
        Blocker::Agent(other) => Some(other),
        Blocker::Wall | Blocker::Obstacle(_) | Blocker::Unknown => None,
    };
    json!({"agent": reverted.agent, "rule": reverted.rule, "cause": reverted.blocker.kind(), "other": other})
}

/// Prints the content of a saved map, or the error in it.
fn check_file(path: &str) -> Result<(), Error> {
    let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, error))?;
    let is_text = [".txt", ".map"].iter().any(|end| path.ends_with(end));
    let content = if is_text { read_map_text(&text) } else { read_config(&text) };
    println!("{}", content.unwrap_or_else(|error| json!({"error": error.to_string()})));
    Ok(())
}

fn read_map_text(text: &str) -> Result<Value, Error> {
    let MapText { map, starts, goals, pools } = parse_map_text(text)?;
    Ok(json!({"rows": map.rows(), "agents": starts, "goals": goals, "pools": pools}))
}

/// Reads a config, and generates an instance of it, because some readable configs cannot be played.
fn read_config(text: &str) -> Result<Value, Error> {
    let config = GridConfig::from_yaml(text)?;
    let value = config.to_value();
    let rows = config.map.as_ref().map(pogema_core::Map::rows);
    InstanceSource::new(config.clone(), None)?.generate()?;
    let pools = config.possible_agents_xy.as_ref().zip(config.possible_targets_xy.as_ref());
    Ok(json!({
        "rows": rows,
        "agents": config.agents_xy,
        "goals": value["targets_xy"],
        "pools": pools,
        "fields": value,
    }))
}
