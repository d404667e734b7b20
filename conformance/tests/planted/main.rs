//! Checks that the kit catches bugs: each planted bug is caught by the cases of its rule, and its counterexample
//! shrinks to a few cells.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod bug;
mod engine;
mod moves;
mod port;
mod views;

use std::fmt::Write as _;
use std::path::Path;

use pogema_conformance::Watch;
use pogema_conformance::port::{Cause, Link, Part, Plan, PortReport, Subject, check_ports, shrink_causes};
use pogema_core::Map;

use bug::{Bug, PLANTED};
use port::Planted;

fn plan() -> Plan {
    Plan {
        num_cases: 0,
        seed: 5,
        rules: None,
        profiles: Vec::new(),
        num_workers: None,
        files: Vec::new(),
        parts: vec![Part::Cases],
    }
}

fn subject(bug: Bug) -> Subject<'static> {
    Subject {
        command: format!("{bug:?}"),
        replay: Vec::new(),
        start: Box::new(move || Ok(Box::new(Planted::new(bug)) as Box<dyn Link>)),
    }
}

fn check(bug: Bug, plan: &Plan) -> PortReport {
    check_ports(&[subject(bug)], plan, |_| (), Watch::default()).unwrap().remove(0)
}

#[test]
fn the_port_without_a_bug_conforms() {
    let plan = Plan { num_cases: 400, parts: Vec::new(), ..plan() };
    let report = check(Bug::None, &plan);
    let found =
        report.causes.iter().map(|cause| format!("{:?}", cause.example)).collect::<Vec<_>>().join("\n");
    assert!(report.causes.is_empty(), "{found}");
    assert!(report.num_played > 4000, "only {} cases", report.num_played);
}

/// Returns the numbers of agents, rows, columns and steps of a counterexample.
fn size(cause: &Cause) -> (usize, usize, usize, usize) {
    let request = &cause.example.request;
    let played = pogema_conformance::play(request);
    let reset = played.records.iter().find_map(|record| match record {
        pogema_conformance::Record::Reset(reset) => Some(reset),
        _ => None,
    });
    let reset = reset.unwrap();
    let steps = played.records.iter().filter(|record| record.step().is_some()).count();
    let map = Map::from_rows(&reset.map).unwrap();
    (reset.state.cells.len(), map.height(), map.width(), steps)
}

/// Bugs whose counterexamples are larger, and the reason.
const LARGER: [(Bug, &str); 2] = [
    (Bug::SoftNoRotation, "the smallest ring on a grid has four agents"),
    (
        Bug::SoftChainStopsAfterOne,
        "a chain of four: an agent that blocks, the blocked one, its first follower, and a second one that moves",
    ),
];

#[test]
fn each_bug_is_caught_by_the_cases_of_its_rule_and_shrinks() {
    let mut table = String::new();
    let mut wrong = String::new();
    for (bug, description, rule) in PLANTED {
        let mut report = check(bug, &plan());
        let folder = tempfile::tempdir().unwrap();
        shrink_causes(&subject(bug), &mut report, &plan(), folder.path(), Watch::default()).unwrap();
        let is_of_rule = |case: &String| case == rule || case.starts_with(&format!("{rule}/"));
        let Some(cause) = report.causes.iter().find(|cause| cause.cases.keys().any(is_of_rule)) else {
            let seen: Vec<_> =
                report.causes.iter().map(|cause| (&cause.rule, &cause.what, &cause.cases)).collect();
            let _ = writeln!(wrong, "{bug:?} is not caught by the cases of {rule}, found: {seen:?}");
            continue;
        };
        let (agents, height, width, steps) = size(cause);
        let is_small = agents <= 3 && height <= 4 && width <= 4 && steps <= 3;
        if !is_small && LARGER.iter().all(|(larger, _)| *larger != bug) {
            let _ = writeln!(
                wrong,
                "the counterexample of {bug:?} has {agents} agents, {height} x {width}, {steps} steps"
            );
        }
        let _ = writeln!(table, "| {description} | `{rule}` | {agents} | {height} × {width} | {steps} |");
    }
    assert!(wrong.is_empty(), "{wrong}");
    check_table(&table);
}

/// Checks the table in `docs/trust.md`; with `BLESS=1`, writes it.
fn check_table(table: &str) {
    const BEGIN: &str = "<!-- planted -->\n";
    const END: &str = "<!-- /planted -->";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/trust.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let begin = text.find(BEGIN).unwrap() + BEGIN.len();
    let end = text.find(END).unwrap();
    let head =
        "| planted bug | caught by the cases of | agents | map | steps |\n| --- | --- | --- | --- | --- |\n";
    let expected = format!("{head}{table}");
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, format!("{}{expected}{}", &text[..begin], &text[end..])).unwrap();
    } else {
        assert_eq!(&text[begin..end], expected, "run with BLESS=1 to write docs/trust.md");
    }
}
