//! Ctrl-C ends the long commands with status 130 and one line. The work that they have done is kept.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::fs;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};

fn start(folder: &Path, arguments: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pogema"));
    command.args(arguments).current_dir(folder).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits until a condition holds; panics if the process ends first.
fn wait_until(process: &mut Child, holds: impl Fn(u32) -> bool) {
    while !holds(process.id()) {
        assert_eq!(process.try_wait().unwrap(), None, "the process has ended");
        std::thread::yield_now();
    }
}

/// Returns whether a process handles Ctrl-C.
fn handles_ctrl_c(process: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    caught.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).unwrap() & 2 != 0)
}

/// Presses Ctrl-C; returns the exit status, standard output and standard error.
fn interrupt(process: Child) -> (Option<i32>, String, String) {
    assert!(Command::new("kill").args(["-INT", &process.id().to_string()]).status().unwrap().success());
    let output = process.wait_with_output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

const SUITE: &str = "
environment: {name: Environment, on_target: nothing, collision_system: soft, size: 32, max_episode_steps: 128,
              density: 0.3, num_agents: 250, seed: {grid_search: [0, 1, 2]}}
algorithms:
  Quick: {name: random}
  Slow: {name: CBS, seconds: 100}
";

#[test]
fn an_interrupted_evaluation_keeps_its_episodes() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("suite.yaml"), SUITE).unwrap();
    let mut process = start(at, &["evaluate", "suite.yaml", "--out", "results", "--threads", "1"]);
    wait_until(&mut process, |_| at.join("results/Slow.jsonl").exists());
    let (status, _, error) = interrupt(process);
    let expected = "interrupted: 0 of 3 episodes of `Slow` are stored; `--resume` plays the rest: results\n";
    assert_eq!((status, error.as_str()), (Some(130), expected));
    let kept = fs::read_to_string(at.join("results/Quick.json")).unwrap();
    assert_eq!(kept.matches("\"metrics\"").count(), 3, "{kept}");
}

#[test]
fn an_interrupted_plan_ends_with_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let plan = [
        "plan",
        "--size",
        "64",
        "--num-agents",
        "200",
        "--density",
        "0.2",
        "--seed",
        "1",
        "--seconds",
        "1000",
    ];
    let mut process = start(folder.path(), &plan);
    wait_until(&mut process, handles_ctrl_c);
    let (status, text, error) = interrupt(process);
    assert_eq!((status, error.as_str(), text.lines().count()), (Some(130), "", 1), "{text}");
    assert!(text.starts_with("interrupted: "), "{text}");
}

#[test]
fn an_interrupted_benchmark_ends_with_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let mut process = start(folder.path(), &["bench", "--rows", "64 agents, 32 x 32", "--seconds", "1000"]);
    wait_until(&mut process, handles_ctrl_c);
    let (status, text, error) = interrupt(process);
    assert_eq!((status, text.as_str(), error.lines().count()), (Some(130), "", 1), "{error}");
    assert!(error.starts_with("interrupted: "), "{error}");
}

#[test]
fn an_interrupted_comparison_reports_what_it_checked() {
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("report.json");
    let mut process = start(folder.path(), &["conform", "--cases", "1000000000", "--json", "report.json"]);
    wait_until(&mut process, handles_ctrl_c);
    let (status, text, error) = interrupt(process);
    assert_eq!((status, error.as_str()), (Some(130), ""), "{text}");
    assert!(
        text.ends_with("all agree: 0 divergences\ninterrupted: only what is counted above was checked\n"),
        "{text}"
    );
    assert!(fs::read_to_string(report).unwrap().contains("\"fresh\""));
}

/// A port that answers only `hello`, and creates a file at the first question that it does not answer.
const MUTE_PORT: &str = r#"
import json, sys
hello = {
    "protocol": "pogema-conform/1", "name": "mute", "profiles": ["core"], "collision": ["soft"], "on_goal": ["finish"],
}
for line in sys.stdin:
    if json.loads(line)["type"] == "hello":
        print(json.dumps(hello), flush=True)
    else:
        open("asked", "a").write("x")
"#;

/// Ctrl-C in a terminal reaches the port, too. The end of the port must not count as a crash.
#[test]
fn an_interrupted_check_of_a_port_reports_no_crash() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("port.py"), MUTE_PORT).unwrap();
    // Without the interrupt, the check would wait for a day.
    let files =
        ["--json", "report.json", "--html", "report.html", "--badge", "badge.svg", "--junit", "report.xml"];
    let arguments = [&["conform", "--port", "python3 port.py", "--timeout", "86400"], &files[..]].concat();
    let mut command = Command::new(env!("CARGO_BIN_EXE_pogema"));
    command.args(arguments).current_dir(at).process_group(0);
    let mut process = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_until(&mut process, |id| handles_ctrl_c(id) && at.join("asked").exists());
    let group = format!("-{}", process.id());
    assert!(Command::new("kill").args(["-INT", "--", &group]).status().unwrap().success());
    let output = process.wait_with_output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(130), "{text}");
    assert!(text.contains("cases not reached"), "{text}");
    assert!(text.contains("interrupted, no new cause so far: 0 cases, 0 steps"), "{text}");
    for file in ["report.json", "report.html"] {
        assert!(at.join(file).exists(), "{file}");
    }
    assert!(fs::read_to_string(at.join("badge.svg")).unwrap().contains("interrupted 0/"));
    // A dashboard shows the run as failed.
    let junit = fs::read_to_string(at.join("report.xml")).unwrap();
    assert!(junit.contains("errors=\"1\"") && junit.contains("name=\"(interrupted)\""), "{junit}");
}

/// Ctrl-C in a terminal reaches POGEMA's process, too. If this process ends, the report must not be lost.
#[test]
fn an_interrupted_comparison_with_pogema_reports_what_it_checked() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let python = folder.path().join("python");
    fs::write(&python, "#!/bin/sh\ntouch asked\nexec sleep 86400\n").unwrap();
    fs::set_permissions(&python, fs::Permissions::from_mode(0o755)).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_pogema"));
    command.args(["conform", "--cases", "20", "--oracle", "--json", "report.json"]).current_dir(&folder);
    command.env("POGEMA_ORACLE_PYTHON", &python).process_group(0);
    let mut process = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_until(&mut process, |id| handles_ctrl_c(id) && folder.path().join("asked").exists());
    let group = format!("-{}", process.id());
    assert!(Command::new("kill").args(["-INT", "--", &group]).status().unwrap().success());
    let output = process.wait_with_output().unwrap();
    let (text, error) =
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert_eq!((output.status.code(), error.as_str()), (Some(130), ""), "{text}");
    assert!(text.contains("interrupted: only what is counted above was checked"), "{text}");
    assert!(folder.path().join("report.json").exists());
}
