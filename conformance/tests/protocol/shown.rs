//! Checks that a rule passes only if the answers of the port show it, and that each difference has its own rule.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use pogema_conformance::port::{
    Ask, Hello, Key, Part, Plan, PortReport, Profile, Reply, ReplyKey, Subject, Verdicts, check_ports,
};
use pogema_conformance::{Watch, cases};
use pogema_core::{Occupancy, Reward};

use crate::links::AlteredPort;
use crate::{cause_names, check};

fn check_plan(plan: &Plan, hello: fn(&mut Hello), reply: fn(&Ask, &mut Reply)) -> PortReport {
    let subject = Subject {
        command: "altered".into(),
        replay: Vec::new(),
        start: Box::new(move || Ok(AlteredPort::boxed(hello, reply))),
    };
    check_ports(&[subject], plan, |_| (), Watch::default()).unwrap().remove(0)
}

fn case(name: &str) -> PathBuf {
    cases::folder().join(name)
}

#[test]
fn the_callers_actions_are_compared_under_every_collision_system() {
    let report = check(
        |_| (),
        |_, reply| reply.actions_after = reply.actions_after.take().map(|list| vec![0; list.len()]),
    );
    let row = report.rules["collide/soft/rewrite"];
    assert!(row.failed > 0 && row.passed == 0, "{row:?}");
}

#[test]
fn a_wrong_map_fails_the_cases_about_maps() {
    fn full_of_obstacles(_: &Ask, reply: &mut Reply) {
        for row in reply.map.iter_mut().flatten() {
            *row = "#".repeat(row.len());
        }
    }
    let report = check(|_| (), full_of_obstacles);
    for rule in ["config/map", "grid/text", "grid/letters", "grid/pools", "grid/named"] {
        // Cases that expect an error have no map.
        assert!(report.rules[rule].failed > 0, "{rule}: {:?}", report.rules[rule]);
    }
}

#[test]
fn rules_whose_values_the_port_never_reports_are_not_claimed() {
    fn core(hello: &mut Hello) {
        hello.profiles = vec![Profile::Core];
        hello.occupancy = vec![Occupancy::AsReleased, Occupancy::Exact];
        hello.tells.clear();
    }
    let row = |report: &PortReport, rule: &str| report.rules[rule];
    let exact = row(&check(core, |_, _| ()), "occupancy/exact");
    assert_eq!(exact, Verdicts { not_claimed: exact.not_claimed, ..Verdicts::default() });
    let report = check(
        |hello| {
            core(hello);
            hello.tells = vec![ReplyKey::Occupied];
        },
        |_, _| (),
    );
    assert!(row(&report, "occupancy/exact").passed > 0);
    let unknown = check(|_| (), |_, reply| reply.foretold = Key::Null);
    let foretold = row(&unknown, "goal/restart/foretold");
    assert!(foretold.not_claimed > 0 && foretold.passed == 0, "{foretold:?}");
}

#[test]
fn a_rule_that_is_not_claimed_does_not_pass_if_another_rule_fails() {
    fn own_rewards(hello: &mut Hello) {
        hello.reward = vec![Reward::Own];
    }
    let wrong_metrics = |_: &Ask, reply: &mut Reply| {
        if let Key::Given(metrics) = &mut reply.metrics {
            metrics.isr = metrics.isr.map(|value| value + 1.0);
        }
    };
    let report = check(own_rewards, wrong_metrics);
    assert!(report.rules["metrics/nothing"].failed > 0, "{:?}", report.rules);
    let shared = report.rules["reward/shared"];
    assert_eq!(shared, Verdicts { not_claimed: shared.not_claimed, ..Verdicts::default() });
    assert!(shared.not_claimed > 0);
}

/// The kit has no instance of such a config, but must still ask the port.
#[test]
fn a_port_that_accepts_an_unknown_map_fails() {
    fn accepts(ask: &Ask, reply: &mut Reply) {
        if matches!(ask, Ask::Reset(_)) && reply.error.take().is_some() {
            let cells = Some(vec![[0, 0]]);
            *reply =
                Reply { cells: cells.clone(), goals: cells, active: Some(vec![true]), ..Reply::default() };
        }
    }
    let plan = Plan { files: vec![case("grid/named/unknown.yaml")], ..Plan::default() };
    let report = check_plan(&plan, |_| (), accepts);
    assert!(report.misbehaves() || report.diverges(), "{:?}", report.rules);
    assert_eq!(cause_names(&check_plan(&plan, |_| (), |_, _| ())), [""; 0]);
}

#[test]
fn a_run_of_any_number_of_random_episodes_can_be_stopped() {
    let stop = AtomicBool::new(true);
    let plan = Plan { parts: vec![Part::Drawn], num_cases: u64::MAX, ..Plan::default() };
    let subject = Subject {
        command: "altered".into(),
        replay: Vec::new(),
        start: Box::new(|| Ok(AlteredPort::boxed(|_| (), |_, _| ()))),
    };
    let watch = Watch { stop: &stop, ..Watch::default() };
    let reports = check_ports(&[subject], &plan, |_| (), watch).unwrap();
    assert_eq!((reports[0].num_played, reports[0].num_interrupted), (0, u64::MAX));
}

#[test]
fn wrong_shared_rewards_break_their_own_rule() {
    fn halves(_: &Ask, reply: &mut Reply) {
        reply.rewards.iter_mut().flatten().for_each(|reward| *reward /= 2.0);
    }
    let report = check(|hello| hello.reward = vec![Reward::Shared], halves);
    let causes = cause_names(&report);
    assert!(causes.contains(&r#"Some("reward/shared") reward"#.to_owned()), "{causes:?}");
    let report = check(|hello| hello.reward = vec![Reward::Own], halves);
    assert!(!cause_names(&report).iter().any(|name| name.contains("reward/shared")));
}

#[test]
fn numbers_outside_every_map_are_wrong_answers_in_histories_and_foretold_goals() {
    fn far_outside(_: &Ask, reply: &mut Reply) {
        for list in [&mut reply.changes, &mut reply.full] {
            list.iter_mut().flatten().flatten().for_each(|change| change.0 -= 1000);
        }
        if let Key::Given(lists) = &mut reply.foretold {
            lists.iter_mut().flatten().for_each(|goal| goal[1] -= 1000);
        }
    }
    let report = check(|_| (), far_outside);
    assert!(report.diverges() && !report.misbehaves(), "{:?}", cause_names(&report));
    for rule in ["history/changes", "goal/restart/foretold"] {
        assert!(report.rules[rule].failed > 0, "{rule}: {:?}", report.rules[rule]);
    }
}

#[test]
fn profiles_that_are_not_selected_are_not_reported_as_not_claimed() {
    let plan = Plan { profiles: vec![Profile::Core], parts: vec![Part::Cases], ..Plan::default() };
    let report = check_plan(&plan, |_| (), |_, _| ());
    let named: Vec<_> = report.not_claimed.keys().filter(|what| what.starts_with("profile")).collect();
    assert_eq!(named, [""; 0]);
    assert!(report.hello.as_ref().unwrap().profiles.contains(&Profile::History));
    assert!(!report.rules.contains_key("history/step-back"), "{:?}", report.rules.keys());
    assert!(report.rules["collide/soft"].passed > 0);
}
