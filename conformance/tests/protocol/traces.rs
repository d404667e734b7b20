//! Checks traces that ports write.

use std::path::PathBuf;

use pogema_conformance::port::check_traces;
use pogema_core::{
    Action, Cell, Environment, InputLimit, Observed, Snapshot, StepOut, Trace, TraceHeader, TraceStart,
    TraceStep,
};
use pogema_maps::{GridConfig, InstanceSource};
use pogema_reference::Reference;
use serde_json::json;

/// Returns the trace of an episode as a port may write it: without observations and metrics.
fn trace() -> Trace {
    let config = json!({
        "size": 5, "num_agents": 4, "density": 0.1, "seed": 1, "collision_system": "soft",
        "on_target": "restart", "max_episode_steps": 12, "empty_outside": false,
    });
    let config = GridConfig::from_value(&config).unwrap();
    let instance = InstanceSource::new(config.clone(), None).unwrap().generate().unwrap().instance;
    let mut environment = Reference::new(config.rules()).unwrap();
    environment.reset(&instance).unwrap();
    let state = environment.snapshot();
    let header = TraceHeader::new(config.rules(), &instance, 14);
    let mut trace = Trace { header, start: TraceStart { state, observations: None }, steps: Vec::new() };
    for step in 0..12 {
        let actions: Vec<Action> = (0..4).map(|agent| Action::ALL[(step * 3 + agent) % 5]).collect();
        let (mut rewards, mut terminated, mut truncated) = (vec![0.0; 4], vec![false; 4], vec![false; 4]);
        let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
        environment.step(&actions, out).unwrap();
        let state: Snapshot = environment.snapshot();
        trace.steps.push(TraceStep {
            actions,
            state,
            rewards,
            terminated,
            truncated,
            observations: None,
            metrics: None,
        });
    }
    trace
}

fn write_trace(trace: &Trace, folder: &tempfile::TempDir, name: &str) -> PathBuf {
    let path = folder.path().join(name);
    let mut text = Vec::new();
    trace.write(&mut text).unwrap();
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn a_correct_trace_passes_and_an_altered_one_fails() {
    let folder = tempfile::tempdir().unwrap();
    let right = trace();
    let mut wrong = right.clone();
    wrong.steps[7].state.cells[2] = Cell::new(0, 0);
    let paths = [write_trace(&right, &folder, "right.jsonl"), write_trace(&wrong, &folder, "wrong.jsonl")];
    let report = check_traces(&paths[..1], InputLimit::default()).unwrap();
    assert!(!report.diverges() && report.num_steps == 12);
    assert!(report.rules["collide/soft"].passed == 1 && report.rules["reward/own"].passed == 1);
    let report = check_traces(&paths, InputLimit::default()).unwrap();
    assert_eq!(report.causes.len(), 1);
    let found = report.causes[0].example.divergence.as_ref().unwrap();
    assert_eq!(
        (found.op, found.field.to_string().as_str(), found.rule.as_str()),
        (8, "cell 2", "collide/soft")
    );
    assert!(report.causes[0].example.name.ends_with("wrong.jsonl"));
}

/// Our config rejects a limit of 0 steps in lifelong mode unless it is persistent, but a trace may have this limit.
#[test]
fn a_trace_with_a_limit_of_zero_steps_is_compared() {
    let folder = tempfile::tempdir().unwrap();
    let mut wrong = trace();
    wrong.header.config.max_steps = 0;
    wrong.steps.truncate(1);
    wrong.steps[0].truncated = vec![true; 4];
    wrong.steps[0].rewards[1] = 5.0;
    let report = check_traces(&[write_trace(&wrong, &folder, "wrong.jsonl")], InputLimit::default()).unwrap();
    let causes: Vec<_> =
        report.causes.iter().map(|cause| (cause.rule.as_deref(), cause.what.as_str())).collect();
    assert_eq!(causes, [(Some("reward/own"), "reward")]);
    assert_eq!(report.rules["place/explicit"].passed, 1, "{:?}", report.rules);
}

#[test]
fn missing_metrics_and_partly_missing_observations_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let mut trace = trace();
    let report = check_traces(&[write_trace(&trace, &folder, "none.jsonl")], InputLimit::default()).unwrap();
    assert_eq!(report.not_claimed.keys().collect::<Vec<_>>(), ["metrics, missing after step 12"]);
    trace.start.observations =
        Some(Observed::Default { dtype: "float32".into(), windows: vec![String::new(); 4], odd: Vec::new() });
    let report = check_traces(&[write_trace(&trace, &folder, "some.jsonl")], InputLimit::default()).unwrap();
    assert!(
        report.not_claimed.contains_key("observations, missing after step 1"),
        "{:?}",
        report.not_claimed
    );
}

#[test]
fn invalid_traces_are_rejected_with_their_path() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("not-a-trace");
    std::fs::write(&path, "{}\n").unwrap();
    let error = check_traces(&[&path], InputLimit::default()).unwrap_err().to_string();
    assert!(error.contains("not-a-trace") && error.contains("line 1"), "{error}");
    let missing = folder.path().join("missing");
    let error = check_traces(&[missing], InputLimit::default()).unwrap_err().to_string();
    assert!(error.contains("missing: "), "{error}");
}
