//! The circumstances that a shrunk counterexample needs. Counterexamples that need different ones have different
//! causes.

use pogema_core::{Action, Cell, Map, Snapshot};
use pogema_maps::GridConfig;

use super::claims::Mode;
use super::group::Example;
use crate::compare::{Field, FieldPart};
use crate::play::play;
use crate::request::{Op, Record};

/// Describes the circumstances that a shrunk example still has, and therefore needs; empty if it breaks no rule.
pub fn circumstances(example: &Example) -> String {
    let Some(found) = &example.divergence else { return String::new() };
    if example.mode == Mode::Config {
        return "the port draws the instance".into();
    }
    let played = play(&example.request);
    let Some(map) = played.map_at(found.op) else { return String::new() };
    let is_reset = |op: &usize| matches!(played.records.get(*op), Some(Record::Reset(_)));
    let Some(begin) = (0..=found.op).rev().find(is_reset) else { return String::new() };
    // The states of the episode before the difference. If the reset itself differs, the state after it.
    let end = found.op.clamp(begin + 1, played.records.len());
    let states: Vec<&Snapshot> = played.records[begin..end].iter().filter_map(Record::state).collect();
    let Some(state) = states.last() else { return String::new() };
    let mut parts = vec![if state.cells.len() == 1 { "one agent" } else { "several agents" }.to_owned()];
    if states.iter().flat_map(|state| &state.cells).any(|&cell| map.is_obstacle(cell)) {
        parts.push("one on an obstacle".into());
    }
    if !state.active.iter().all(|&is_active| is_active) {
        parts.push("one finished".into());
    }
    let last_part = || match (example.request.ops.get(found.op)?, found.field) {
        (Op::Step(actions), Field { name: "cell", part: FieldPart::Element(agent) }) => {
            Some(format!("the agent aims at {}", aim(&map, state, agent, *actions.get(agent)?)?))
        }
        _ => channel(found.field, example),
    };
    parts.extend(last_part());
    parts.join(", ")
}

/// Describes the cell that an agent aims at.
fn aim(map: &Map, state: &Snapshot, agent: usize, action: i64) -> Option<&'static str> {
    let action = Action::from_number(agent, action).ok()?;
    let cell = *state.cells.get(agent)?;
    let there = Cell::checked(cell.toward(action));
    let stands = |is_active: bool| {
        let mut agents = state.cells.iter().zip(&state.active);
        agents.any(|(&other, &active)| Some(other) == there && active == is_active)
    };
    Some(match there.filter(|&there| map.contains(there)) {
        _ if action == Action::Stay => "its own cell",
        None => "the wall",
        Some(there) if map.is_obstacle(there) => "an obstacle",
        Some(_) if stands(true) => "the cell of an agent",
        Some(_) if stands(false) => "the cell of a finished agent",
        Some(_) => "an empty cell",
    })
}

/// Describes the channel of a window of type `default` that differs.
fn channel(field: Field, example: &Example) -> Option<String> {
    let FieldPart::Window { value: Some(value), .. } = field.part else { return None };
    let default = GridConfig::default().obs_radius as u64;
    let radius = example.request.config.get("obs_radius").map_or(Some(default), serde_json::Value::as_u64)?;
    let area = (2 * radius as usize + 1).pow(2);
    let channel =
        ["obstacles", "agents", "goal"].get(value / area).filter(|_| field.name == "observation")?;
    Some(format!("channel {channel}"))
}
