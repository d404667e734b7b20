//! Checks that counterexamples are shrunk and can still be reproduced, for ports that crash, hang or reject episodes,
//! and for ports with several bugs in one field.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod unreliable;

use std::path::Path;

use pogema_conformance::port::{
    Cause, FaultKind, Misbehaviour, Part, Plan, PortReport, check_ports, shrink_causes,
};
use pogema_conformance::{Watch, cases};

use unreliable::{Behaviour, Log, subject};

/// Checks a port with cases and random episodes, and shrinks the counterexamples.
fn check(behaviour: Behaviour, folder: &Path) -> (PortReport, Log) {
    let log = Log::default();
    let subject = subject(behaviour, &log);
    let plan = Plan {
        num_cases: 400,
        seed: 3,
        num_workers: Some(2),
        parts: vec![Part::Cases, Part::Drawn],
        ..Plan::default()
    };
    let mut report = check_ports(&[subject], &plan, |_| (), Watch::default()).unwrap().remove(0);
    let subject = unreliable::subject(behaviour, &log);
    shrink_causes(&subject, &mut report, &plan, folder, Watch::default()).unwrap();
    (report, log)
}

fn num_agents(cause: &Cause) -> usize {
    let played = pogema_conformance::play(&cause.example.request);
    played.records[0].state().unwrap().cells.len()
}

/// Checks that a cause is kept, that its file can be read, and that the replay showed the cause.
fn assert_repeated(cause: &Cause) {
    assert_eq!(cause.is_repeated, Some(true), "{:?}", cause.what);
    let path = cause.kept.as_ref().unwrap();
    cases::read(path).unwrap().request().unwrap();
    let words = shell_words::split(cause.replay.as_ref().unwrap()).unwrap();
    assert_eq!(words, ["check", "--case", path.to_str().unwrap()]);
}

#[test]
fn shrinking_respects_claims() {
    let folder = tempfile::tempdir().unwrap();
    let (report, log) = check(Behaviour::RefusesObstacles, folder.path());
    assert_eq!(log.num_configs(), 0);
    let causes: Vec<_> = report
        .causes
        .iter()
        .map(|cause| (cause.rule.as_deref(), cause.what.as_str(), cause.when.as_str()))
        .collect();
    assert_eq!(causes, [(Some("place/explicit"), "error", "one agent, one on an obstacle")]);
    let cause = &report.causes[0];
    assert_repeated(cause);
    assert_eq!(num_agents(cause), 1);
    // The picture shows the obstacle under the agent.
    let shown = cause.example.divergence.as_ref().unwrap().to_string();
    assert!(shown.contains("a at [0,0] hides the goal of a, an obstacle"), "{shown}");
}

#[test]
fn a_port_that_crashes_now_and_then_gets_small_counterexamples() {
    let folder = tempfile::tempdir().unwrap();
    let (report, log) = check(Behaviour::CrashesAtTimesAndDoublesRewards, folder.path());
    assert!(log.num_faults() > 20, "the port crashed only {} times", log.num_faults());
    let cause = report.causes.iter().find(|cause| cause.what == "reward").unwrap();
    assert!(num_agents(cause) <= 2, "{} agents", num_agents(cause));
    assert!(cause.example.request.ops.len() <= 3);
    let crash = report.causes.iter().find(|cause| cause.rule.is_none()).unwrap();
    assert!(crash.kept.is_some() && crash.is_repeated.is_some());
}

#[test]
fn crashes_and_malformed_answers_are_shrunk_and_kept() {
    for (behaviour, what) in [
        (Behaviour::CrashesIfTwoMove, "ended (exit status: 1) instead of answering `step`"),
        (Behaviour::ForgetsActiveIfTwoMove, "left `active` out of an answer that needs it"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let (report, _) = check(behaviour, folder.path());
        assert_eq!(report.causes.len(), 1);
        let cause = &report.causes[0];
        assert_eq!((cause.rule.as_deref(), cause.what.as_str()), (None, what));
        assert_repeated(cause);
        assert_eq!((num_agents(cause), cause.example.request.ops.len()), (2, 2), "{what}");
        assert_eq!(cause.example.op(), Some(1));
    }
}

#[test]
fn a_hanging_port_is_asked_a_bounded_number_of_times() {
    let folder = tempfile::tempdir().unwrap();
    let (report, log) = check(Behaviour::HangsIfTwoMove, folder.path());
    // Missing answers: 5 and one per further worker in the run, 30 while shrinking, 3 in replays.
    assert!(log.num_faults() <= 39, "{} answers never came", log.num_faults());
    assert!(report.num_not_run > 0);
    let cause = &report.causes[0];
    assert_eq!(cause.what, "gave no answer to `step` within 10 s");
    assert_repeated(cause);
    assert!(num_agents(cause) <= 3, "{} agents", num_agents(cause));
}

#[test]
fn a_mute_port_is_started_once_per_worker() {
    let folder = tempfile::tempdir().unwrap();
    let (report, log) = check(Behaviour::IsMute, folder.path());
    assert!(log.num_faults() <= 2, "{} answers never came", log.num_faults());
    assert_eq!((report.num_played, report.causes.len()), (0, 1));
    let cause = &report.causes[0];
    assert_eq!(cause.what, "gave no answer to `hello` within 60 s");
    assert!(cause.kept.is_none() && cause.replay.is_none());
}

#[test]
fn several_bugs_in_one_field_are_several_causes() {
    let folder = tempfile::tempdir().unwrap();
    let (report, _) = check(Behaviour::DoublesRewardsInTwoCases, folder.path());
    let is_own = |cause: &&Cause| cause.rule.as_deref() == Some("reward/own") && cause.what == "reward";
    let causes: Vec<&Cause> = report.causes.iter().filter(is_own).collect();
    let mut when: Vec<&str> = causes.iter().map(|cause| cause.when.as_str()).collect();
    when.sort_unstable();
    assert_eq!(when, ["one agent, one on an obstacle", "several agents, one finished"]);
    let shares: Vec<_> = causes.iter().map(|cause| cause.share.unwrap()).collect();
    assert!(shares[0].alike >= shares[1].alike);
    assert!(shares.iter().all(|share| share.shrunk == shares[0].alike + shares[1].alike));
    assert_ne!(causes[0].kept, causes[1].kept);
    causes.into_iter().for_each(assert_repeated);
}

#[test]
fn a_difference_that_a_new_process_does_not_show_is_reported_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let (report, _) = check(Behaviour::DoublesRewardsAtFirst, folder.path());
    let cause = report.causes.iter().find(|cause| cause.what == "reward").unwrap();
    assert_eq!(cause.is_repeated, Some(false));
    assert!(cause.kept.is_some());
}

#[test]
fn a_counterexample_keeps_the_seed_of_its_reset() {
    let folder = tempfile::tempdir().unwrap();
    let (report, _) = check(Behaviour::DoublesRewardsAfterSeeds, folder.path());
    let cause = report.causes.iter().find(|cause| cause.what == "reward").unwrap();
    assert_repeated(cause);
    assert_eq!((num_agents(cause), cause.example.request.ops.len()), (1, 2));
}

#[test]
fn a_report_survives_a_folder_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    let log = Log::default();
    let subject = subject(Behaviour::DoublesRewardsInTwoCases, &log);
    let plan = Plan { parts: vec![Part::Cases], ..Plan::default() };
    let mut report = check_ports(&[subject], &plan, |_| (), Watch::default()).unwrap().remove(0);
    let subject = unreliable::subject(Behaviour::DoublesRewardsInTwoCases, &log);
    let kept = file.join("kept");
    let error = shrink_causes(&subject, &mut report, &plan, &kept, Watch::default()).unwrap_err().to_string();
    assert!(error.starts_with(&format!("{}: ", kept.display())) && error.contains("directory"), "{error}");
    assert!(report.diverges() && report.causes.iter().all(|cause| cause.kept.is_none()));
}

#[test]
fn misbehaviours_match_regardless_of_the_time_limit() {
    let hang = |question, limit_ms| Misbehaviour::new(FaultKind::NoAnswer { question, limit_ms }, "");
    assert!(hang("step", 1000).is_like(&hang("step", 100)));
    assert!(!hang("step", 1000).is_like(&hang("reset", 1000)));
}
