//! The examples in the help texts run, and the program shows first steps if it is called without arguments.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

mod program;

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Output;
use std::{env, fs};

const PROGRAM: &str = env!("CARGO_BIN_EXE_pogema");

/// All commands, in an order in which each finds the files that earlier examples write. The last three take long.
const COMMANDS: [&str; 18] = [
    "run",
    "plan",
    "validate",
    "maps list",
    "maps show",
    "maps generate",
    "maps export",
    "maps import",
    "maps tiles",
    "maps editor",
    "maps stats",
    "evaluate",
    "views",
    "replay",
    "render",
    "conform",
    "port",
    "bench",
];

const SUITE: &str = "
environment: {name: Environment, on_target: nothing, collision_system: soft, size: 8, max_episode_steps: 32,
              num_agents: {grid_search: [2, 4]}, seed: {grid_search: [0, 1]}}
algorithms:
  LaCAM: {name: LaCAM, nodes: 200}
  Random: {name: random}
results_views:
  Means: {type: tabular, drop_keys: [seed]}
  Costs: {type: plot, x: num_agents, y: SoC}
";

fn pogema(arguments: &[&str], folder: &Path) -> Output {
    let program_folder = Path::new(PROGRAM).parent().unwrap();
    let path = env::var_os("PATH").unwrap();
    let path =
        env::join_paths([program_folder.to_path_buf()].into_iter().chain(env::split_paths(&path))).unwrap();
    program::command(folder, arguments).env("PATH", path).output().unwrap()
}

fn help(command: &str) -> String {
    let words: Vec<&str> = command.split_whitespace().chain(["--help"]).collect();
    String::from_utf8(pogema(&words, Path::new(".")).stdout).unwrap()
}

/// Returns the commands that the help of a command lists.
fn commands(command: &str) -> Vec<String> {
    let help = help(command);
    let (_, list) = help.split_once("Commands:\n").unwrap();
    let lines = list.lines().take_while(|line| !line.is_empty());
    let words = lines.map(|line| line.split_whitespace().next().unwrap());
    words.filter(|word| *word != "help").map(str::to_owned).collect()
}

fn examples(command: &str) -> Vec<String> {
    let help = help(command);
    let (_, examples) = help.split_once("Examples:\n").unwrap_or_else(|| panic!("{command} has no examples"));
    examples.lines().map(|line| line.trim().to_owned()).filter(|line| !line.is_empty()).collect()
}

#[test]
fn all_commands_are_listed_here() {
    let whole = commands("").into_iter().filter(|command| command != "maps");
    let parts = commands("maps").into_iter().map(|command| format!("maps {command}"));
    let expected: BTreeSet<String> = whole.chain(parts).collect();
    assert_eq!(BTreeSet::from(COMMANDS.map(str::to_owned)), expected);
}

#[test]
fn examples_of_short_commands_run() {
    run_examples(&COMMANDS[..15]);
}

#[test]
#[ignore = "half a minute: `./check slow` runs it"]
fn examples_of_all_commands_run() {
    run_examples(&COMMANDS);
}

fn run_examples(commands: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("config.yaml"), "{size: 8, num_agents: 2, seed: 3, collision_system: soft}").unwrap();
    fs::write(path.join("suite.yaml"), SUITE).unwrap();
    let template = Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/ports/template.py");
    fs::copy(template, path.join("adapter.py")).unwrap();
    for command in commands {
        for example in examples(command) {
            let words = shell_words::split(&example).unwrap();
            let words: Vec<&str> = words.iter().skip(1).map(String::as_str).collect();
            let output = pogema(&words, path);
            assert!(output.status.success(), "{example}\n{}", String::from_utf8_lossy(&output.stderr));
        }
    }
}

#[test]
fn without_arguments_first_steps_are_shown() {
    let output = pogema(&[], Path::new("."));
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8(output.stdout).unwrap();
    let commands: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("  pogema ")).collect();
    assert_eq!(commands.len(), 3, "{text}");
}
