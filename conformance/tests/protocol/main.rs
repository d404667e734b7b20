//! Checks which answers ports may give, in which forms, and how a run judges them.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod links;
mod schema;
mod shown;
mod traces;

use pogema_conformance::port::{
    Ask, Hello, Link, Mode, Part, Plan, PortReport, Profile, Reply, ReplyKey, Server, Subject, check_ports,
    play_on_port,
};
use pogema_conformance::{NamedEngine, Op, Request, Watch, rules};
use pogema_core::{Collision, Observation, Occupancy, OnGoal, Reward};
use serde_json::{Map, Value, json};

use links::{AlteredPort, in_fnv, in_halves, in_numbers, in_sha256, in_wrong_sha256, terse};

fn check(hello: fn(&mut Hello), reply: fn(&Ask, &mut Reply)) -> PortReport {
    check_part(Part::Cases, hello, reply)
}

fn check_part(part: Part, hello: fn(&mut Hello), reply: fn(&Ask, &mut Reply)) -> PortReport {
    let subject = Subject {
        command: "altered".into(),
        replay: Vec::new(),
        start: Box::new(move || Ok(AlteredPort::boxed(hello, reply))),
    };
    let plan = Plan { parts: vec![part], num_cases: 40, ..Plan::default() };
    check_ports(&[subject], &plan, |_| (), Watch::default()).unwrap().remove(0)
}

fn cause_names(report: &PortReport) -> Vec<String> {
    report.causes.iter().map(|cause| format!("{:?} {}", cause.rule, cause.what)).collect()
}

#[test]
fn answers_may_omit_what_can_be_requested() {
    assert_eq!(cause_names(&check(|_| (), terse)), [""; 0]);
}

#[test]
fn windows_may_be_numbers_or_hashes() {
    for form in [in_numbers, in_sha256, in_fnv] {
        let report = check(|_| (), form);
        assert_eq!(cause_names(&report), [""; 0]);
        assert!(report.rules["observe/default/goal"].passed > 0);
    }
}

#[test]
fn a_wrong_hash_and_a_value_of_one_half_are_differences() {
    for form in [in_wrong_sha256, in_halves] {
        let report = check(|_| (), form);
        assert!(report.diverges() && !report.misbehaves(), "{:?}", cause_names(&report));
        assert!(report.causes.iter().all(|cause| cause.rule.as_ref().unwrap().starts_with("observe/")));
        assert!(report.rules["observe/default/goal"].failed > 0);
    }
    let report = check(|_| (), in_halves);
    let got: Vec<&str> =
        report.causes.iter().map(|cause| &*cause.example.divergence.as_ref().unwrap().got).collect();
    assert!(got.iter().any(|got| got.contains("of agent 0: value 4 is 0.5")), "{got:?}");
}

#[test]
fn unknown_keys_are_ignored() {
    let hello = json!({
        "protocol": "pogema-conform/1", "name": "n", "profiles": ["core"], "collision": ["soft"],
        "on_goal": ["finish"], "mood": "good",
    });
    let hello: Hello = serde_json::from_value(hello).unwrap();
    assert_eq!((hello.max_agents, hello.noise), (usize::MAX, false));
    let reply: Reply = serde_json::from_value(json!({ "cells": [[1, 2]], "colour": 3 })).unwrap();
    assert_eq!(reply.cells, Some(vec![[1, 2]]));
}

#[test]
fn unclaimed_features_are_listed_and_never_requested() {
    fn modest(hello: &mut Hello) {
        hello.profiles = vec![Profile::Core, Profile::Observations];
        hello.collision = vec![Collision::Priority];
        hello.on_goal = vec![OnGoal::Finish, OnGoal::Restart];
        hello.observation = vec![Observation::Default];
        hello.noise = false;
        hello.tells = Vec::new();
    }
    fn strict(ask: &Ask, _: &mut Reply) {
        let Ask::Reset(beginning) = ask else {
            assert!(matches!(ask, Ask::Step { .. }), "{ask:?} was not claimed");
            return;
        };
        let config = beginning.instance.as_ref().unwrap().config;
        assert_eq!(config.collision, Collision::Priority);
        assert_ne!(config.on_goal, OnGoal::Nothing);
        assert_eq!(config.observation, Observation::Default);
        assert!(beginning.config.is_none() && beginning.measure.is_empty() && !config.persistent);
    }
    let report = check(modest, strict);
    assert_eq!(cause_names(&report), [""; 0]);
    for what in [
        "collision soft",
        "collision block_both",
        "on_goal nothing",
        "observation MAPF",
        "profile metrics",
        "profile seeding",
        "profile history",
        "profile policies",
    ] {
        assert!(report.not_claimed.contains_key(what), "{what} is missing from {:?}", report.not_claimed);
    }
    for rule in ["collide/soft/swap", "metrics/finish", "place/order", "history/step-back", "policy/astar"] {
        let row = report.rules[rule];
        assert!(row.not_claimed > 0 && row.passed + row.failed + row.errors == 0, "{rule}: {row:?}");
    }
    assert!(report.rules["collide/priority/swap"].passed > 0);
    // In random episodes, an unclaimed feature can leave out a whole family of rules.
    let drawn = check_part(Part::Drawn, modest, strict);
    assert!(drawn.rules["reward/own"].passed > 0);
    assert!(drawn.not_claimed.contains_key("profile history"), "{:?}", drawn.not_claimed);
    for rule in drawn.rules.keys() {
        assert!(rules::statement_of(rule).is_some(), "{rule} is no rule");
    }
}

#[test]
fn all_metrics_that_a_port_does_not_claim_are_listed() {
    let report = check(|hello| hello.metrics = vec!["ISR".into()], |_, _| ());
    assert_eq!(cause_names(&report), [""; 0]);
    for what in
        ["metrics CSR and ep_length", "metrics CSR, ep_length, SoC and makespan", "metric avg_throughput"]
    {
        assert!(report.not_claimed.contains_key(what), "{what} is missing from {:?}", report.not_claimed);
    }
}

#[test]
fn a_case_that_is_played_in_two_modes_counts_once_as_unchecked() {
    fn without_metrics(hello: &mut Hello) {
        hello.profiles.retain(|profile| *profile != Profile::Metrics);
    }
    let report = check_part(Part::Drawn, without_metrics, |_, _| ());
    assert!(report.hello.as_ref().unwrap().profiles.contains(&Profile::Seeding));
    let unchecked = report.not_claimed["profile metrics"];
    assert!((1..=report.num_played).contains(&unchecked), "{unchecked} of {}", report.num_played);
}

fn without_seeding(hello: &mut Hello) {
    hello.profiles.retain(|profile| *profile != Profile::Seeding);
}

#[test]
fn random_episodes_use_the_fields_that_pogema_lacks_only_if_they_are_claimed() {
    fn like_pogema(hello: &mut Hello) {
        without_seeding(hello);
        hello.occupancy = vec![Occupancy::AsReleased];
        hello.reward = vec![Reward::Own];
    }
    fn strict(ask: &Ask, _: &mut Reply) {
        if let Ask::Reset(beginning) = ask {
            let config = beginning.instance.as_ref().unwrap().config;
            assert_eq!((config.occupancy, config.reward), (Occupancy::AsReleased, Reward::Own));
        }
    }
    let all = check_part(Part::Drawn, without_seeding, |_, _| ());
    for rule in ["occupancy/as-released", "occupancy/exact", "reward/own", "reward/shared"] {
        assert!(all.rules[rule].passed > 0, "{rule}: {:?}", all.rules);
    }
    let report = check_part(Part::Drawn, like_pogema, strict);
    assert_eq!(report.num_played, all.num_played);
    for what in ["occupancy exact", "reward shared"] {
        assert!(report.not_claimed.contains_key(what), "{what} is missing from {:?}", report.not_claimed);
    }
}

#[test]
fn a_claimed_key_must_be_present() {
    fn forgets(_: &Ask, reply: &mut Reply) {
        reply.occupied = None;
    }
    let report = check(|_| (), forgets);
    assert!(report.misbehaves());
    assert_eq!(report.causes[0].what, "left `occupied` out of an answer that needs it");
    let report = check(|hello| hello.tells.retain(|key| *key != ReplyKey::Occupied), forgets);
    assert_eq!(cause_names(&report), [""; 0]);
}

#[test]
fn every_claimed_key_must_be_present_at_a_reset() {
    fn first_cause(forgets: fn(&Ask, &mut Reply)) -> String {
        check(|_| (), forgets).causes[0].what.clone()
    }
    let left_out = |key: &str| format!("left `{key}` out of an answer that needs it");
    assert_eq!(first_cause(|_, reply| reply.padded = None), left_out("padded"));
    assert_eq!(first_cause(|_, reply| reply.derived = None), left_out("derived"));
    assert_eq!(first_cause(|_, reply| drop(std::mem::take(&mut reply.foretold))), left_out("foretold"));
}

/// `Ask::Act` is the only question that asks for the actions of a policy.
#[test]
fn a_port_that_claims_policies_without_seeding_plays_astar_from_instances() {
    fn waits(ask: &Ask, reply: &mut Reply) {
        if let (Ask::Act { .. }, Some(actions)) = (ask, &mut reply.actions) {
            actions.fill(0);
        }
    }
    let report = check(without_seeding, |_, _| ());
    assert_eq!(cause_names(&report), [""; 0]);
    assert!(report.rules["policy/astar"].passed > 0);
    let report = check(without_seeding, waits);
    assert!(report.rules["policy/astar"].failed > 0, "{:?}", cause_names(&report));
}

#[test]
fn a_number_that_is_not_an_action_is_charged_to_the_rule_of_the_policy() {
    fn seven(ask: &Ask, reply: &mut Reply) {
        if let (Ask::Act { .. }, Some(actions)) = (ask, &mut reply.actions) {
            actions[0] = 7;
        }
    }
    let report = check(without_seeding, seven);
    assert!(report.rules["policy/astar"].failed > 0 && report.rules["config/fields"].failed == 0);
    for cause in &report.causes {
        assert_eq!(cause.rule.as_deref(), Some("policy/astar"));
        let found = cause.example.divergence.as_ref().unwrap();
        assert!(found.field.name == "actions" && found.got.contains('7'), "{found:?}");
    }
    assert_eq!(report.causes.len(), 1, "{:?}", cause_names(&report));
}

/// The reference gives the answers that docs/PORTING.md shows.
#[test]
fn the_conversation_in_the_guide_is_right() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/PORTING.md");
    let text = std::fs::read_to_string(path).unwrap();
    let mut server = Server::new(NamedEngine::REFERENCE);
    let (mut question, mut num_answers) = (None, 0);
    for line in text.lines() {
        if let Some(line) = line.strip_prefix("> ") {
            question = Some(serde_json::from_str::<Ask>(line).unwrap());
        } else if let (Some(line), Some(ask)) = (line.strip_prefix("< "), question.take()) {
            let keys: Map<String, Value> = serde_json::from_str(line).unwrap();
            let (shown, given) = if matches!(ask, Ask::Hello { .. }) {
                let shown: Hello = serde_json::from_str(line).unwrap();
                (json!(shown), json!(server.hello().unwrap()))
            } else {
                let shown: Reply = serde_json::from_str(line).unwrap();
                (json!(shown), json!(server.ask(&ask).unwrap()))
            };
            let fails = |answer: &Value| answer.get("error").is_some_and(Value::is_string);
            assert_eq!(fails(&shown), fails(&given), "{line}");
            for key in keys.keys() {
                let (shown, given) = (shown.get(key).unwrap(), given.get(key).unwrap());
                match key.as_str() {
                    // Each port has its own values.
                    "name" | "version" | "error" => assert!(shown.is_string() && given.is_string()),
                    // The reference claims more.
                    "profiles" | "collision" | "on_goal" => {
                        let claimed = given.as_array().unwrap();
                        assert!(
                            shown.as_array().unwrap().iter().all(|word| claimed.contains(word)),
                            "{line}"
                        );
                    }
                    _ => assert_eq!(shown, given, "{key} in {line}"),
                }
            }
            num_answers += 1;
        }
    }
    assert_eq!(num_answers, 5);
}

/// A port that plays an instance returns the records of the reference.
#[test]
fn a_port_steps_in_lockstep_with_the_reference() {
    for observation in ["default", "POMAPF", "MAPF"] {
        let config = json!({
            "size": 6, "num_agents": 5, "density": 0.2, "seed": 3, "collision_system": "soft",
            "on_target": "restart", "observation_type": observation, "obs_radius": 2, "max_episode_steps": 30,
        });
        let actions =
            |step: usize| (0..5).map(|agent| ((step * 7 + agent * 3 + step / 3) % 5) as i64).collect();
        let steps = (0..30).map(|step| Op::Step(actions(step)));
        let ops = std::iter::once(Op::Reset(None)).chain(steps).collect();
        let request = Request { config, ops, ..Request::default() };
        let expected = pogema_conformance::play(&request);
        let mut server = Server::new(NamedEngine::LITERAL);
        let hello = server.hello().unwrap();
        let answered = play_on_port(&mut server, &hello, Mode::Instance, &request, &expected);
        assert_eq!(answered.fault, None);
        assert_eq!(answered.response.records.len(), 31);
        for (expected, actual) in expected.records.iter().zip(&answered.response.records).skip(1) {
            assert_eq!(expected, actual, "{observation}");
        }
    }
}
