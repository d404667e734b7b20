//! The schema in the tree fits what is really said.

use std::path::Path;
use std::sync::{Arc, Mutex};

use jsonschema::Validator;
use pogema_conformance::NamedEngine;
use pogema_conformance::port::{
    Ask, Hello, Link, Misbehaviour, PROTOCOL, Part, Plan, Reply, Server, Subject, check_ports,
};
use serde_json::{Value, json};

/// Writes down what is said.
struct Listening {
    server: Server,
    said: Arc<Mutex<Vec<Value>>>,
}

impl Listening {
    fn note(&self, value: &impl serde::Serialize) {
        self.said.lock().unwrap().push(serde_json::to_value(value).unwrap());
    }
}

impl Link for Listening {
    fn hello(&mut self) -> Result<Hello, Misbehaviour> {
        self.note(&Ask::Hello { protocol: PROTOCOL.into() });
        let hello = self.server.hello()?;
        self.note(&hello);
        Ok(hello)
    }

    fn ask(&mut self, ask: &Ask) -> Result<Reply, Misbehaviour> {
        self.note(ask);
        let reply = self.server.ask(ask)?;
        self.note(&reply);
        Ok(reply)
    }
}

fn schema() -> Validator {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("protocol/pogema-conform-1.schema.json");
    let schema: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    jsonschema::meta::validate(&schema).unwrap();
    jsonschema::validator_for(&schema).unwrap()
}

#[test]
fn all_that_is_said_fits_the_schema() {
    let said = Arc::new(Mutex::new(Vec::new()));
    let start = || {
        let link = Listening { server: Server::new(NamedEngine::REFERENCE), said: Arc::clone(&said) };
        Ok(Box::new(link) as Box<dyn Link>)
    };
    let subject = Subject { command: "listening".into(), start: Box::new(start) };
    let plan = Plan { parts: vec![Part::Cases], ..Plan::default() };
    check_ports(&[subject], &plan, |_| (), &|| ()).unwrap();
    let schema = schema();
    let said = said.lock().unwrap();
    assert!(said.len() > 1000, "only {} lines were said", said.len());
    for line in said.iter() {
        if let Err(wrong) = schema.validate(line) {
            panic!("{line}\n{wrong}");
        }
    }
}

#[test]
fn what_is_wrong_does_not_fit_the_schema() {
    let schema = schema();
    for wrong in [
        json!({ "type": "reset", "instance": {} }),
        json!({ "type": "reset", "instance": {}, "config": {} }),
        json!({ "type": "step" }),
        json!({ "type": "dance" }),
        json!({ "protocol": "pogema-conform/2", "name": "n" }),
        json!({ "protocol": PROTOCOL, "name": "n", "profiles": ["all"], "collision": [], "on_goal": [] }),
        json!({ "cells": [[1, 2, 3]] }),
        json!({ "active": [1] }),
        json!({ "observations": ["0g"] }),
        json!([]),
    ] {
        assert!(!schema.is_valid(&wrong), "{wrong}");
    }
}
