//! Checks that we reject all configs that a live POGEMA 1.4.0 rejects, and reject others only for a known reason.
//!
//! `POGEMA_ORACLE_PYTHON=python cargo test -p pogema-conformance --test rejects_live`

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail by panicking")]

mod draw;
mod reasons;
mod tables;

use std::collections::BTreeMap;
use std::path::Path;

use pogema_conformance::{NamedEngine, Op, Oracle, Registered, Request};
use pogema_core::{Error, Map};
use pogema_maps::{GridConfig, InstanceSource};
use serde_json::Value;

const NUM_DRAWN: u64 = 2_000;

fn start_pogema() -> Oracle {
    let python = std::env::var_os("POGEMA_ORACLE_PYTHON").unwrap_or_else(|| {
        panic!("POGEMA_ORACLE_PYTHON is not set, expected the path of a Python with POGEMA 1.4.0")
    });
    Oracle::start(Path::new(&python)).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the class of the error with which POGEMA rejects a config or its first reset.
fn pogema_error(pogema: &mut Oracle, request: &Request) -> Option<String> {
    let answer = pogema.ask(request).unwrap_or_else(|error| panic!("{error}: {request:?}"));
    answer.error.map(|error| error.kind)
}

/// Returns the message with which we reject a config or its first reset.
fn our_error(request: &Request) -> Option<String> {
    let reset = || -> Result<(), Error> {
        let config = GridConfig::from_value(&request.config)?;
        let named = request.register.as_ref().filter(|map| config.map_name.as_ref() == Some(&map.name));
        let registered = named.map(|map| Map::from_rows(&map.rows)).transpose()?;
        let rules = config.rules();
        let instance = InstanceSource::new(config, registered)?.generate()?.instance;
        (NamedEngine::REFERENCE.make)(rules)?.reset(&instance)
    };
    reset().err().map(|error| error.to_string())
}

/// Returns a request with a config, which may name the map `narrow`.
fn request(config: &str) -> Request {
    let config: Value = serde_json::from_str(config).unwrap_or_else(|error| panic!("{config}: {error}"));
    let register = Some(Registered { name: "narrow".into(), rows: vec!["#.".into()] });
    Request { id: 0, config, register, density: false, collisions: false, ops: vec![Op::Reset(None)] }
}

#[test]
fn configs_that_pogema_rejects_are_rejected() {
    let mut pogema = start_pogema();
    for (kind, config, part) in tables::REJECTED {
        let request = request(config);
        assert_eq!(pogema_error(&mut pogema, &request).as_deref(), Some(kind), "POGEMA on {config}");
        let message = our_error(&request).unwrap_or_else(|| panic!("we accept {config}"));
        assert!(message.contains(part), "{config}: {message}");
    }
}

#[test]
fn maps_that_pogema_does_not_register_are_rejected() {
    let mut pogema = start_pogema();
    for (kind, rows, part) in tables::UNREGISTRABLE {
        let rows = rows.iter().map(|&row| row.to_owned()).collect();
        let register = Some(Registered { name: "broken".into(), rows });
        let request = Request { register, ..request(r#"{"map_name": "broken"}"#) };
        assert_eq!(pogema_error(&mut pogema, &request).as_deref(), Some(kind));
        let message = our_error(&request).unwrap_or_else(|| panic!("we accept {:?}", request.register));
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn configs_that_only_we_reject_have_the_expected_reason() {
    let mut pogema = start_pogema();
    for (reason, config) in tables::REJECTED_BY_US {
        let request = request(config);
        assert_eq!(pogema_error(&mut pogema, &request), None, "POGEMA on {config}");
        let message = our_error(&request).unwrap_or_else(|| panic!("we accept {config}"));
        assert_eq!(reasons::reason(&request.config, &message), Some(reason), "{config}: {message}");
    }
    for reason in reasons::names() {
        assert!(tables::REJECTED_BY_US.iter().any(|(known, _)| *known == reason), "no config for: {reason}");
    }
}

#[test]
fn valid_configs_are_accepted_by_both() {
    let mut pogema = start_pogema();
    for config in tables::ACCEPTED {
        let request = request(config);
        assert_eq!(pogema_error(&mut pogema, &request), None, "POGEMA on {config}");
        assert_eq!(our_error(&request), None, "{config}");
    }
}

#[test]
fn random_configs_have_the_same_outcome_or_a_known_reason() {
    let mut pogema = start_pogema();
    let mut wrong = Vec::new();
    let mut counts = BTreeMap::<&str, u64>::new();
    for case in 0..NUM_DRAWN {
        let request = draw::request(case);
        let theirs = pogema_error(&mut pogema, &request);
        let outcome = match (theirs.as_deref(), our_error(&request)) {
            // Errors of the oracle itself: it timed out, or cannot drive the wrapper of a framework.
            (Some("Timeout" | "ProtocolError"), _) => "not comparable",
            (Some(_), Some(_)) => "both reject",
            (None, None) => "both accept",
            (Some(kind), None) => {
                wrong.push(format!(
                    "only POGEMA rejects, {kind}: {}",
                    serde_json::to_string(&request).unwrap()
                ));
                "only POGEMA rejects"
            }
            (None, Some(message)) => reasons::reason(&request.config, &message).unwrap_or_else(|| {
                wrong
                    .push(format!("only we reject: {message}: {}", serde_json::to_string(&request).unwrap()));
                "only we reject, for no known reason"
            }),
        };
        *counts.entry(outcome).or_default() += 1;
    }
    println!("{counts:#?}");
    assert!(wrong.is_empty(), "{} of {NUM_DRAWN}\n{}", wrong.len(), wrong.join("\n"));
    for outcome in ["both reject", "both accept"] {
        assert!(counts.get(outcome).is_some_and(|&count| count > NUM_DRAWN / 10), "{counts:#?}");
    }
    assert!(counts.get("not comparable").is_none_or(|&count| count < NUM_DRAWN / 10), "{counts:#?}");
}
