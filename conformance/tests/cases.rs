//! Checks the hand-written cases on the reference and the literal engine.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_conformance::{NamedEngine, cases, golden, play_on};

#[test]
fn every_case_holds_on_the_reference_and_the_literal_engine() {
    let mut wrong = Vec::new();
    let files = golden::files(&cases::folder(), ".yaml").unwrap();
    assert!(!files.is_empty(), "no cases in {}", cases::folder().display());
    for path in files {
        let case = cases::read(&path).unwrap();
        assert!(case.checks_something(), "{} expects nothing", path.display());
        for engine in [NamedEngine::REFERENCE, NamedEngine::LITERAL] {
            if let Some(mismatch) = case.mismatch(&play_on(engine, &case.request().unwrap())) {
                wrong.push(format!("{} on {}: {mismatch}", path.display(), engine.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Returns the mismatch that a case with two agents finds, given its expectations and steps.
fn mismatch(text: &str) -> Option<String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("case.yaml");
    let observation = if text.contains("xy") { "POMAPF" } else { "default" };
    let config =
        format!("{{map: \"a.b B.A\", obs_radius: 1, persistent: true, observation_type: {observation}}}");
    std::fs::write(&path, format!("rule: move/free\nsays: An example.\nconfig: {config}\n{text}")).unwrap();
    let case = cases::read(&path).unwrap();
    case.mismatch(&play_on(NamedEngine::REFERENCE, &case.request().unwrap()))
}

#[test]
fn expectations_hold_if_the_answer_meets_them() {
    for text in [
        "start: {cells: [[0, 0], [0, 2]]}\nsteps: [{do: [right, stay], cells: [[0, 1], [0, 2]]}]",
        "start: {sees: {agent: 1, obstacles: '111 ..1 ..1'}}",
        "start: {sees: {agent: 1, goal: '... ... 1..'}, derived: {num_agents: 2}}",
        "start: {sees: {agent: 1, obstacles: '111 ..1 ..1'}, xy: [[0, 0], [0, 0]]}",
        "steps: [{do: [right, stay]}, {op: back, moved: true}, {op: history}]",
        "start: {cells: [[0, 0], [0, 2]]}\nsteps: [{do: [stay, 5]}]\nerror: is `5`",
    ] {
        assert_eq!(mismatch(text), None, "{text}");
    }
}

#[test]
fn a_step_has_actions_or_an_operation() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("case.yaml");
    let error = |step: &str| {
        let text = format!("rule: move/free\nsays: An example.\nconfig: {{map: a.A}}\nsteps: [{step}]");
        std::fs::write(&path, text).unwrap();
        cases::read(&path).and_then(|case| case.request()).unwrap_err().to_string()
    };
    for op in ["astar", "reset", "jump"] {
        let text = format!("`op` is `{op}`, expected no `op`, because the step has `do`");
        assert!(error(&format!("{{do: [stay], op: {op}}}")).contains(&text));
    }
    assert!(error("{op: jump}").contains("`op` is `jump`, expected either `do` or one of reset, back,"));
    assert!(error("{}").contains("`op` is `absent`"));
    assert!(error("{op: back, seed: 3}").contains("`seed` is `3`, expected no seed"));
}

#[test]
fn an_error_belongs_to_the_last_step() {
    let early = "steps: [{do: [stay, 9]}, {do: [stay, stay], cells: [[9, 9], [9, 9]]}]\nerror: is `9`";
    let found = mismatch(early).unwrap();
    assert!(found.contains("expected the error in the last step, got it in operation 1"), "{found}");
    let found = mismatch("steps: [{do: [stay, 9], cells: [[9, 9], [9, 9]]}]\nerror: is `9`").unwrap();
    assert!(found.contains("expectation in addition to its error"), "{found}");
}

#[test]
fn an_expectation_that_cannot_be_checked_is_a_mismatch() {
    for (text, key) in [
        ("start: {rewards: [0, 0]}", "rewards"),
        ("start: {moved: true}", "moved"),
        ("start: {foretold: [[[0, 0]], [[0, 0]]]}", "foretold"),
        ("start: {reward: [0, 0]}", "reward"),
        ("start: {global_xy: [[0, 0], [0, 0]]}", "global_xy"),
        ("steps: [{do: [stay, stay], padded: '.'}]", "padded"),
        ("steps: [{do: [stay, stay], derived: {size: 3}}]", "derived"),
        ("steps: [{op: history, cells: [[0, 0], [0, 2]]}]", "cells"),
        ("steps: [{op: back, sees: {agent: 0, agents: '.'}}]", "sees"),
        ("steps: [{do: [stay, stay], changes: []}]", "changes"),
    ] {
        let found = mismatch(text).unwrap_or_default();
        assert!(found.contains(&format!("`{key}`")), "{text}: {found}");
    }
}

#[test]
fn wrong_windows_and_wrong_states_before_an_error_are_mismatches() {
    for (text, found) in [
        ("start: {sees: {agent: 5, agents: '.'}}", "the windows of agent 5 are missing"),
        (
            "start: {sees: {agent: 5, agents: '.'}, xy: [[0, 0], [0, 0]]}",
            "the windows of agent 5 are missing",
        ),
        ("start: {sees: {agent: 0, obstacles: '11'}}", "obstacles window"),
        ("start: {sees: {agent: 0, goal: '.'}, xy: [[0, 0], [0, 0]]}", "goal window"),
        ("start: {derived: {depth: 3}}", "derived depth"),
        ("start: {cells: [[0, 0], [0, 1]]}\nsteps: [{do: [stay, 5]}]\nerror: is `5`", "cells: expected"),
        ("steps: [{do: [stay, stay]}]\nerror: is `5`", "expected the error `is `5``, got none"),
    ] {
        let got = mismatch(text).unwrap_or_default();
        assert!(got.contains(found), "{text}: {got}");
    }
}
