//! Compares the size of drawings with POGEMA 1.4.0's drawings of the same episodes.
//!
//! The environment variable `POGEMA_ORACLE_PYTHON` names a Python with POGEMA 1.4.0.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

#[path = "../common/mod.rs"]
mod common;

use std::io::Write as _;
use std::process::{Command, Stdio};

use common::{Policy, config, trace};
use pogema_core::Trace;
use pogema_render::{Style, svg};

/// Plays the actions on standard input, and prints the final cells and goals, then the drawing.
const SCRIPT: &str = r#"
import json, sys, tempfile, warnings
warnings.filterwarnings("ignore")
from pogema import AnimationConfig, AnimationMonitor, GridConfig, pogema_v0
request = json.load(sys.stdin)
env = AnimationMonitor(pogema_v0(GridConfig(**request["config"])), AnimationConfig(save_every_idx_episode=None))
env.reset()
for actions in request["actions"]:
    env.step(actions)
grid = env.unwrapped.grid
print(json.dumps([grid.get_agents_xy(ignore_borders=True), grid.get_targets_xy(ignore_borders=True)], default=int))
with tempfile.NamedTemporaryFile("r") as file:
    env.save_animation(file.name, AnimationConfig(egocentric_idx=request["egocentric"]))
    print(file.read())
"#;

/// Returns POGEMA's drawing of an episode, after checking that it played the same episode.
fn drawn_by_pogema(text: &str, trace: &Trace, egocentric: Option<usize>) -> String {
    let python = std::env::var_os("POGEMA_ORACLE_PYTHON")
        .expect("POGEMA_ORACLE_PYTHON is not set, expected the path of a Python with POGEMA 1.4.0");
    let actions: Vec<_> = trace.steps.iter().map(|step| &step.actions).collect();
    let config = pogema_maps::value_from_yaml(text).unwrap();
    let request = serde_json::json!({ "config": config, "actions": actions, "egocentric": egocentric });
    let mut process = Command::new(python)
        .args(["-c", SCRIPT])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    process.stdin.take().unwrap().write_all(request.to_string().as_bytes()).unwrap();
    let output = process.wait_with_output().unwrap();
    assert!(output.status.success(), "{text}");
    let output = String::from_utf8(output.stdout).unwrap();
    let (last, drawing) = output.split_once('\n').unwrap();
    let end = &trace.steps.last().unwrap().state;
    assert_eq!(
        last.parse::<serde_json::Value>().unwrap(),
        serde_json::json!([end.cells, end.goals]),
        "{text}"
    );
    drawing.to_owned()
}

#[test]
fn a_drawing_is_at_most_half_as_large_as_pogemas() {
    let mut too_large = Vec::new();
    for (size, num_agents, steps) in [(8, 8, 32), (16, 8, 64), (32, 32, 128), (64, 64, 256)] {
        for on_target in ["finish", "nothing", "restart"] {
            for (policy, egocentric) in
                [(Policy::AStar, None), (Policy::Random, None), (Policy::AStar, Some(0))]
            {
                let text = format!(
                    "size: {size}\nnum_agents: {num_agents}\nmax_episode_steps: {steps}\non_target: {on_target}\nseed: 5\n"
                );
                let trace = trace(&config(&text), policy);
                let theirs = drawn_by_pogema(&text, &trace, egocentric).len();
                let style = Style { egocentric, ..Style::default() };
                let ours = svg::draw(&trace, &style).unwrap().len();
                let ratio = ours as f64 / theirs as f64;
                println!(
                    "{size:>2} x {size:<2}  {num_agents:>2} agents  {:>3} steps  {on_target:<8}  {policy:?} {egocentric:?}: {ours} / {theirs} = {ratio:.3}",
                    trace.steps.len()
                );
                if ratio > 0.5 {
                    too_large.push(text);
                }
            }
        }
    }
    assert!(too_large.is_empty(), "{too_large:?}");
}
