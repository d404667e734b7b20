//! Compares the sizes of our drawings with those of POGEMA 1.4.0's drawings of the same episodes.
//!
//! The environment variable `POGEMA_ORACLE_PYTHON` names a Python with POGEMA 1.4.0.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

#[path = "../common/mod.rs"]
mod common;

use std::io::Write as _;
use std::process::{Command, Stdio};

use common::{Policy, config, trace};
use pogema_core::{Cell, Trace};
use pogema_render::{Style, svg};

/// Plays each line of standard input, and prints the final cells and goals, and the size of the drawing.
const SCRIPT: &str = r#"
import json, sys, tempfile, warnings
warnings.filterwarnings("ignore")
from pogema import AnimationConfig, AnimationMonitor, GridConfig, pogema_v0
for line in sys.stdin:
    request = json.loads(line)
    env = AnimationMonitor(pogema_v0(GridConfig(**request["config"])), AnimationConfig(save_every_idx_episode=None))
    env.reset()
    for actions in request["actions"]:
        env.step(actions)
    grid = env.unwrapped.grid
    places = [grid.get_agents_xy(ignore_borders=True), grid.get_targets_xy(ignore_borders=True)]
    with tempfile.NamedTemporaryFile("r") as file:
        env.save_animation(file.name, AnimationConfig(egocentric_idx=request["egocentric"]))
        print(json.dumps([*places, len(file.read().encode())], default=int))
"#;

/// An episode to draw.
struct Episode {
    config: String,
    trace: Trace,
    egocentric: Option<usize>,
}

/// Returns the sizes of POGEMA's drawings of episodes, after checking that POGEMA played the same episodes.
fn sizes_in_pogema(episodes: &[Episode]) -> Vec<usize> {
    let python = std::env::var_os("POGEMA_ORACLE_PYTHON")
        .expect("POGEMA_ORACLE_PYTHON is not set, expected the path of a Python with POGEMA 1.4.0");
    let request = |Episode { config, trace, egocentric }: &Episode| {
        let actions: Vec<_> = trace.steps.iter().map(|step| &step.actions).collect();
        let config = pogema_maps::value_from_yaml(config).unwrap();
        serde_json::json!({ "config": config, "actions": actions, "egocentric": egocentric }).to_string()
            + "\n"
    };
    let requests: String = episodes.iter().map(request).collect();
    let mut process = Command::new(python)
        .args(["-c", SCRIPT])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = process.stdin.take().unwrap();
    // The script answers before it has read everything.
    let writer = std::thread::spawn(move || input.write_all(requests.as_bytes()));
    let output = process.wait_with_output().unwrap();
    writer.join().unwrap().unwrap();
    assert!(output.status.success());
    let output = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<&str> = output.lines().collect();
    assert_eq!(lines.len(), episodes.len());
    let size = |(episode, line): (&Episode, &str)| {
        let (cells, goals, size): (Vec<Cell>, Vec<Cell>, usize) = serde_json::from_str(line).unwrap();
        let end = &episode.trace.steps.last().unwrap().state;
        assert_eq!((&cells, &goals), (&end.cells, &end.goals), "{}", episode.config);
        size
    };
    episodes.iter().zip(lines).map(size).collect()
}

#[test]
fn a_drawing_is_at_most_half_as_large_as_pogemas() {
    let mut episodes = Vec::new();
    for (size, num_agents, steps) in [(8, 8, 32), (16, 8, 64), (32, 32, 128), (64, 64, 256)] {
        for on_target in ["finish", "nothing", "restart"] {
            for (policy, egocentric) in
                [(Policy::AStar, None), (Policy::Random, None), (Policy::AStar, Some(0))]
            {
                let text = format!(
                    "size: {size}\nnum_agents: {num_agents}\nmax_episode_steps: {steps}\non_target: {on_target}\nseed: 5\n"
                );
                let trace = trace(&config(&text), policy);
                episodes.push(Episode { config: text, trace, egocentric });
            }
        }
    }
    let mut too_large = Vec::new();
    for (Episode { config, trace, egocentric }, theirs) in episodes.iter().zip(sizes_in_pogema(&episodes)) {
        let style = Style { egocentric: *egocentric, ..Style::default() };
        let ours = svg::draw(trace, &style).unwrap().len();
        let ratio = ours as f64 / theirs as f64;
        println!(
            "{}, egocentric {egocentric:?}, {} steps: {ours} / {theirs} = {ratio:.3}",
            config.trim().replace('\n', ", "),
            trace.steps.len()
        );
        if ratio > 0.5 {
            too_large.push(config);
        }
    }
    assert!(too_large.is_empty(), "{too_large:?}");
}
