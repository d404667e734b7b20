//! Checks the protocol's JSON schema against real messages and against wrong ones.

use std::path::Path;
use std::sync::{Arc, Mutex};

use jsonschema::Validator;
use pogema_conformance::port::{
    Ask, Hello, Link, Misbehaviour, PROTOCOL, Part, Plan, Reply, Server, Subject, check_ports,
};
use pogema_conformance::{NamedEngine, Watch};
use serde_json::{Value, json};

/// A port that records all messages.
struct Recording {
    server: Server,
    messages: Arc<Mutex<Vec<Value>>>,
}

impl Recording {
    fn record(&self, value: &impl serde::Serialize) {
        self.messages.lock().unwrap().push(serde_json::to_value(value).unwrap());
    }
}

impl Link for Recording {
    fn hello(&mut self) -> Result<Hello, Misbehaviour> {
        self.record(&Ask::Hello { protocol: PROTOCOL.into() });
        let hello = self.server.hello()?;
        self.record(&hello);
        Ok(hello)
    }

    fn ask(&mut self, ask: &Ask) -> Result<Reply, Misbehaviour> {
        self.record(ask);
        let reply = self.server.ask(ask)?;
        self.record(&reply);
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
fn all_messages_fit_the_schema() {
    let messages = Arc::new(Mutex::new(Vec::new()));
    let start = || {
        let link = Recording { server: Server::new(NamedEngine::REFERENCE), messages: Arc::clone(&messages) };
        Ok(Box::new(link) as Box<dyn Link>)
    };
    let subject = Subject { command: "recording".into(), replay: Vec::new(), start: Box::new(start) };
    let plan = Plan { parts: vec![Part::Cases], ..Plan::default() };
    check_ports(&[subject], &plan, |_| (), Watch::default()).unwrap();
    let schema = schema();
    let messages = messages.lock().unwrap();
    assert!(messages.len() > 1000, "only {} messages were recorded", messages.len());
    for message in messages.iter() {
        if let Err(wrong) = schema.validate(message) {
            panic!("{message}\n{wrong}");
        }
    }
}

#[test]
fn wrong_messages_do_not_fit_the_schema() {
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
