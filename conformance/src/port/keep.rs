//! Writes counterexamples as cases, which can be read, replayed and kept.

use std::collections::BTreeMap;
use std::path::Path;

use pogema_core::{Action, Error, Map, Observed, ObservedMapf, picture};
use serde::Serialize;
use serde_json::{Value, json};

use super::group::Example;
use crate::compare::{Divergence, Field, FieldPart};
use crate::digits::{lines, windows};
use crate::files;
use crate::play::play;
use crate::request::{Op, Record, Registered};

/// The `rule` of cases that show a violation of the protocol.
pub const PROTOCOL_RULE: &str = "protocol";

/// The file of a case, with its keys in reading order.
#[derive(Serialize)]
struct CaseFile {
    rule: String,
    says: String,
    config: Value,
    #[serde(skip_serializing_if = "Option::is_none")]
    register: Option<Registered>,
    #[serde(skip_serializing_if = "Option::is_none")]
    seed: Option<u64>,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    density: bool,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    collisions: bool,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    start: BTreeMap<&'static str, Value>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    steps: Vec<StepOfFile>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

#[derive(Serialize)]
struct StepOfFile {
    #[serde(rename = "do", skip_serializing_if = "Option::is_none")]
    actions: Option<Vec<Value>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    op: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    seed: Option<u64>,
    #[serde(flatten)]
    expected: BTreeMap<&'static str, Value>,
}

/// Writes an example as a case.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written.
pub fn keep(example: &Example, port: &str, path: &Path) -> Result<(), Error> {
    let text = text_of(example, port).map_err(|error| Error::io(path, error))?;
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
    }
    files::write(path, text.as_bytes())
}

/// Returns the name of the file that keeps an example, without its extension.
pub fn file_stem(example: &Example) -> String {
    let name = match &example.divergence {
        Some(Divergence { rule, field: Field { name, part: FieldPart::Window { .. } }, .. }) => {
            format!("{rule} {name} of agent")
        }
        Some(found) => format!("{} {}", found.rule, found.field.kind()),
        None => format!("{PROTOCOL_RULE} {}", example.what()),
    };
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-")
}

/// Formats an example as a case.
///
/// # Errors
/// If it cannot be written as YAML.
pub fn text_of(example: &Example, port: &str) -> Result<String, String> {
    let request = &example.request;
    let expected = play(request);
    let found = example.divergence.as_ref();
    let field = found.map(|found| found.field);
    let last = example.op().unwrap_or(0);
    let mut start = BTreeMap::new();
    let mut steps = Vec::new();
    let mut map = None;
    for (at, record) in expected.records.iter().enumerate() {
        if let Record::Reset(reset) = record {
            map = Map::from_rows(&reset.map).ok();
        }
        let facts = facts(record, map.as_ref(), field, at == last);
        match (at, &request.ops[at]) {
            (0, _) => start = facts,
            (_, op) => steps.push(step_of(op, facts)),
        }
    }
    if expected.error.is_some()
        && let Some(op) = request.ops.get(expected.records.len())
        && !expected.records.is_empty()
    {
        steps.push(step_of(op, BTreeMap::new()));
    }
    let file = CaseFile {
        rule: found.map_or_else(|| PROTOCOL_RULE.into(), |found| found.rule.clone()),
        says: match (field, &example.fault) {
            (None, Some(fault)) => format!("{port} {} in operation {last}.", fault.kind),
            (field, _) => {
                format!("{port} differs in: {}.", field.map(|field| field.to_string()).unwrap_or_default())
            }
        },
        config: request.config.clone(),
        register: request.register.clone(),
        seed: request.ops.first().and_then(seed_of),
        density: request.density,
        collisions: request.collisions,
        start,
        steps,
        error: expected.error.map(|error| error.message),
    };
    serde_saphyr::to_string(&file).map_err(|error| error.to_string())
}

fn step_of(step: &Op, expected: BTreeMap<&'static str, Value>) -> StepOfFile {
    let (actions, op) = match step {
        Op::Step(actions) => (Some(actions.iter().copied().map(word).collect()), None),
        other => (None, Some(other.word())),
    };
    StepOfFile { actions, op, seed: seed_of(step), expected }
}

fn seed_of(op: &Op) -> Option<u64> {
    if let Op::Reset(seed) = op { *seed } else { None }
}

fn word(number: i64) -> Value {
    match Action::from_number(0, number) {
        Ok(action) => format!("{action:?}").to_lowercase().into(),
        Err(_) => number.into(),
    }
}

/// Returns the expectations of a moment: a picture, and for the last moment everything that could differ.
fn facts(
    record: &Record,
    map: Option<&Map>,
    field: Option<Field>,
    is_last: bool,
) -> BTreeMap<&'static str, Value> {
    let mut facts = BTreeMap::new();
    let (Some(state), Some(map)) = (record.state(), map) else {
        if let Record::History(history) = record {
            facts.insert("changes", json!(history.changes));
        }
        return facts;
    };
    facts.insert("picture", json!(picture::picture(map, state)));
    if !is_last {
        return facts;
    }
    facts.insert("cells", json!(state.cells));
    facts.insert("goals", json!(state.goals));
    facts.insert("active", json!(state.active));
    facts.insert("on_goal", json!(state.on_goal));
    facts.insert("occupied", json!(picture::occupancy_picture(map, state)));
    match record {
        Record::Reset(reset) => {
            facts.insert("padded", json!(reset.padded.rows.join("\n")));
            add_sees(&mut facts, reset.observations.as_ref(), field);
        }
        Record::Step(step) | Record::Astar(step) | Record::Sample(step) => {
            facts.insert("rewards", json!(step.step.rewards));
            facts.insert("terminated", json!(step.step.terminated));
            facts.insert("truncated", json!(step.step.truncated));
            facts.insert("metrics", json!(step.step.metrics.unwrap_or_default()));
            if field.is_some_and(|field| field.name == "caller's action") {
                facts.insert("actions_after", json!(step.actions_after));
            }
            add_sees(&mut facts, step.step.observations.as_ref(), field);
        }
        Record::Back(back) => drop(facts.insert("moved", json!(back.moved))),
        Record::History(_) | Record::Odd(_) => {}
    }
    facts
}

/// Adds the `default` observation of the agent whose observation differs, or the relative coordinates of all agents.
fn add_sees(facts: &mut BTreeMap<&'static str, Value>, observed: Option<&Observed>, field: Option<Field>) {
    let Some((field, agent)) = field.and_then(|field| Some((field, field.index()?))) else { return };
    match observed {
        Some(Observed::Default { windows: all, .. }) if field.name == "observation" => {
            let Some(seen) = all.get(agent).and_then(|digits| windows(digits)) else { return };
            let [obstacles, agents, goal] = seen.map(|window| lines(&window));
            facts.insert(
                "sees",
                json!({ "agent": agent, "obstacles": obstacles, "agents": agents, "goal": goal }),
            );
        }
        Some(Observed::Pomapf(pomapf) | Observed::Mapf(ObservedMapf { pomapf, .. })) => {
            facts.insert("xy", json!(pomapf.xy));
            facts.insert("target_xy", json!(pomapf.target_xy));
        }
        _ => {}
    }
}
