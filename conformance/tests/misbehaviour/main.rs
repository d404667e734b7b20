//! Checks that a run survives a misbehaving port: it continues, reports the fault, and leaves no process behind.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;
use std::time::Duration;

use pogema_conformance::port::{
    Command, Link, Part, Plan, PortReport, Process, Subject, Verdicts, check_ports,
};
use pogema_conformance::{Oracle, Request, Watch};

/// The time limit of an answer: short if the port never answers, else long enough for a busy machine.
fn timeout(way: &str) -> Duration {
    if way.ends_with("hang") || way == "deaf" {
        Duration::from_millis(1500)
    } else {
        Duration::from_secs(120)
    }
}

fn bad_port(way: &str, folder: &Path) -> Command {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/misbehaviour/bad_port.py");
    let words = ["python3.11", script.to_str().unwrap(), way, folder.to_str().unwrap()];
    Command::new(&shell_words::join(words), timeout(way)).unwrap()
}

fn check(way: &str, folder: &Path) -> PortReport {
    let command = bad_port(way, folder);
    let start = || Process::start(&command).map(|process| Box::new(process) as Box<dyn Link>);
    let subject = Subject { command: command.text.clone(), replay: Vec::new(), start: Box::new(start) };
    let plan = Plan {
        num_cases: 0,
        seed: 0,
        rules: Some(glob::Pattern::new("end/*").unwrap()),
        profiles: Vec::new(),
        num_workers: Some(2),
        files: Vec::new(),
        parts: vec![Part::Cases],
    };
    check_ports(&[subject], &plan, |_| (), Watch::default()).unwrap().remove(0)
}

fn headings(report: &PortReport) -> Vec<&str> {
    report.causes.iter().filter(|cause| cause.rule.is_none()).map(|cause| cause.what.as_str()).collect()
}

/// Checks that a fault is reported and that the run plays further cases after it.
fn assert_fault(way: &str, what: &str) -> PortReport {
    let folder = tempfile::tempdir().unwrap();
    let report = check(way, folder.path());
    let faults: Vec<String> =
        report.causes.iter().filter_map(|cause| Some(cause.example.fault.as_ref()?.what.clone())).collect();
    assert!(faults.iter().any(|fault| fault.contains(what)), "{way}: {faults:?}");
    assert!(report.misbehaves(), "{way}");
    let errors: u64 = report.rules.values().map(|row| row.errors).sum();
    assert_eq!(errors, 1, "{way}: expected one case with the verdict `error`");
    assert!(report.num_played >= 5, "{way}: the run did not continue");
    assert_eq!(report.num_not_run, 0, "{way}");
    report
}

#[test]
fn a_port_that_exits_is_reported_with_its_status_and_last_output() {
    let report = assert_fault("exit", "ended (exit status: 7) instead of answering `step`");
    let fault = report.causes.iter().find_map(|cause| cause.example.fault.clone()).unwrap();
    assert_eq!(fault.stderr, "the reason is here");
    assert_fault("abort", "ended (signal: 6");
}

#[test]
fn a_port_that_stops_answering_is_reported() {
    assert_fault("hang", "gave no answer to `step` within 1.5 s");
    assert_fault("half-line-then-hang", "gave no answer to `step` within 1.5 s");
    assert_fault("closes-stdout", "closed its output instead of answering `step`");
}

#[test]
fn unreadable_answers_are_quoted() {
    assert_fault(
        "garbage",
        "gave no readable answer to `step` (expected value at line 1 column 1): `Traceback",
    );
    assert_fault("half-line", "instead of answering `step`, after half a line: `{\"cells\": [[`");
    assert_fault("binary", "gave no readable answer to `step`");
    assert_fault("null", "gave no readable answer to `step`");
    assert_fault("nan", "gave no readable answer to `step`");
    assert_fault("huge-line", "answered `step` with a line of more than 67108864 bytes");
}

#[test]
fn malformed_answers_are_described() {
    assert_fault("wrong-length", "did not give `rewards` one entry per agent: it has length");
    assert_fault("left-out", "left `truncated` out of an answer that needs it");
    assert_fault("twice", "wrote an unrequested line");
}

#[test]
fn a_flood_on_stderr_neither_blocks_nor_exhausts_memory() {
    let report = assert_fault("stderr-flood", "ended (exit status: 1)");
    let fault = report.causes.iter().find_map(|cause| cause.example.fault.clone()).unwrap();
    assert!(fault.stderr.ends_with("the last words"), "{}", fault.stderr);
    assert!(fault.stderr.len() <= 2048);
}

#[test]
fn headings_of_faults_contain_numbers_but_no_lines_of_the_port() {
    for (way, heading) in [
        ("exit", "ended (exit status: 7) instead of answering `step`"),
        ("hang", "gave no answer to `step` within 1.5 s"),
        ("garbage", "gave no readable answer to `step`"),
        ("half-line", "ended (exit status: 0) instead of answering `step`"),
        ("huge-line", "answered `step` with a line of more than 67108864 bytes"),
        ("wrong-length", "did not give `rewards` one entry per agent"),
        ("twice", "wrote an unrequested line"),
        ("other-protocol", "speaks `other/9`, expected `pogema-conform/1`"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(headings(&check(way, folder.path())), [heading]);
    }
}

#[test]
fn windows_of_another_shape_are_a_difference_and_the_rest_is_checked() {
    let folder = tempfile::tempdir().unwrap();
    let report = check("short-window", folder.path());
    assert!(!report.misbehaves() && report.num_not_run == 0);
    let shapes: Vec<_> = report.causes.iter().filter(|cause| cause.what == "shape of observations").collect();
    assert_eq!(shapes.len(), 1);
    let found = shapes[0].example.divergence.as_ref().unwrap();
    assert_eq!(found.rule, "observe/default");
    assert_eq!(found.expected, "for each agent a window of shape [3, 11, 11]");
    assert_eq!(found.got, "`observations` of agent 0 has 2 values, expected 363");
}

#[test]
fn a_port_that_stops_reading_without_exiting_times_out() {
    assert_fault("deaf", "gave no answer to");
}

#[test]
fn child_processes_end_with_the_port() {
    let folder = tempfile::tempdir().unwrap();
    let report = check("fork", folder.path());
    assert!(report.misbehaves());
    let started = std::fs::read_to_string(folder.path().join("pids")).unwrap();
    assert!(started.lines().count() >= 1, "the port started no process");
    for pid in started.lines() {
        // The process has ended, or is a zombie whose parent has not waited for it.
        let status = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
        let state = status.rsplit(") ").next().and_then(|rest| rest.chars().next());
        assert!(matches!(state, None | Some('Z')), "process {pid} still runs: {status}");
    }
}

#[test]
fn a_port_that_fails_in_hello_or_cannot_start_plays_no_cases() {
    for (way, what) in [
        ("hello-without-protocol", "gave no readable answer to `hello` (missing field `protocol`"),
        ("other-protocol", "speaks `other/9`, expected `pogema-conform/1`"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let report = check(way, folder.path());
        let fault = report.causes[0].example.fault.clone().unwrap();
        assert!(fault.what.contains(what), "{fault}");
        assert!(report.num_not_run > 0);
        assert_eq!(report.num_played, 0);
        // The report leaves out rules whose cases were all skipped: their empty rows would hide the error.
        assert!(report.rules.values().all(|verdicts| *verdicts != Verdicts::default()), "{:?}", report.rules);
    }
    let command = Command::new("there-is-no-such-program --at-all", Duration::from_secs(1)).unwrap();
    let fault = Process::start(&command).err().unwrap();
    assert!(fault.what.starts_with("`there-is-no-such-program` cannot be started"), "{fault}");
    for text in ["  ", "python3 'open"] {
        let error = Command::new(text, Duration::from_secs(1)).err().unwrap().to_string();
        assert!(error.contains("expected a shell command line"), "{error}");
    }
}

/// If a server writes more than fits into a pipe, it blocks until its output is read or it is killed.
#[cfg(unix)]
#[test]
fn an_oracle_with_an_unread_answer_is_killed() {
    use std::os::unix::fs::PermissionsExt as _;

    const SCRIPT: &str = "#!/bin/sh
echo '{\"version\":\"1.4.0\"}'
read -r request
echo garbage
exec head -c 3000000 /dev/zero
";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("python");
    std::fs::write(&path, SCRIPT).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o700)).unwrap();
    let (sender, ended) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let mut oracle = Oracle::start(&path).unwrap();
        let error = oracle.ask(&Request::default()).unwrap_err();
        drop(oracle);
        sender.send(error.to_string()).unwrap();
    });
    let error = ended.recv_timeout(Duration::from_secs(120)).expect("the oracle was never dropped");
    assert!(error.contains("unreadable answer"), "{error}");
}
