//! Draws cases as text pictures for the spec.

use std::fmt::Write as _;

use pogema_core::{Map, picture};
use serde::Serialize;
use serde_json::Value;

use super::{Case, CaseStep, Expect, Sees};
use crate::request::{Record, Response, StepRecord};

/// Maximum number of frames side by side.
const MAX_FRAMES_PER_ROW: usize = 4;

impl Case {
    /// Draws the case as text: its sentence, its config, a frame for each operation with a state, and its other
    /// expectations.
    pub fn draw(&self, response: &Response) -> String {
        let mut text = format!("{}\n\n{}", self.says, self.draw_config());
        let mut map = None;
        let mut frames = Vec::new();
        for (op, record) in response.records.iter().enumerate() {
            if let Record::Reset(reset) = record {
                map = Map::from_rows(&reset.map).ok();
            }
            let step = op.checked_sub(1).and_then(|at| self.steps.get(at));
            if let (Some(map), Some(state)) = (&map, record.state()) {
                frames.push(Frame { head: head(step, record), body: picture::picture(map, state) });
            }
        }
        for row in frames.chunks(MAX_FRAMES_PER_ROW) {
            text.push('\n');
            text.push_str(&side_by_side(row));
        }
        for (op, (record, expect)) in response.records.iter().zip(self.expectations()).enumerate() {
            text.push_str(&draw_facts(op, record, expect));
        }
        if let Some(error) = &response.error {
            let _ = writeln!(text, "\nerror: {}", error.message);
        }
        if let Some(pogema) = &self.pogema {
            let _ = writeln!(text, "\nPOGEMA 1.4.0: {pogema}");
        }
        text.trim_end().to_owned()
    }

    /// Formats the config, one field per line; a multi-line string is indented below its field.
    fn draw_config(&self) -> String {
        let Some(fields) = self.config.as_object() else { return String::new() };
        let is_multiline = |value: &Value| value.as_str().is_some_and(|text| text.contains('\n'));
        let lines = fields.iter().map(|(field, value)| match value.as_str() {
            Some(rows) if is_multiline(value) => {
                let rows: Vec<String> = rows.split_whitespace().map(|row| format!("  {row}\n")).collect();
                format!("{field}:\n{}", rows.concat())
            }
            Some(text) => format!("{field}: {text}\n"),
            None => format!("{field}: {value}\n"),
        });
        lines.collect()
    }
}

struct Frame {
    head: String,
    body: String,
}

fn head(step: Option<&CaseStep>, record: &Record) -> String {
    let word = |step: &StepRecord| {
        let actions = step.step.actions.iter().map(|action| format!("{action:?}").to_lowercase());
        actions.collect::<Vec<_>>().join(", ")
    };
    match (step.and_then(|step| step.op.as_deref()), record) {
        (_, Record::Reset(_)) => "reset".into(),
        (Some(policy @ ("astar" | "sample")), Record::Astar(step) | Record::Sample(step)) => {
            format!("{policy}: {}", word(step))
        }
        (_, Record::Step(step) | Record::Astar(step) | Record::Sample(step)) => word(step),
        (_, Record::Back(_)) => "back".into(),
        // Records without a state get no frame.
        (_, Record::History(_) | Record::Odd(_)) => String::new(),
    }
}

/// Joins frames side by side, each below its operation.
fn side_by_side(frames: &[Frame]) -> String {
    let width = |frame: &Frame| {
        let body = frame.body.lines().map(|line| line.chars().count()).max().unwrap_or(0);
        body.max(frame.head.chars().count())
    };
    let height = frames.iter().map(|frame| frame.body.lines().count()).max().unwrap_or(0);
    let row = |part: &dyn Fn(&Frame) -> String| {
        let cells: Vec<String> =
            frames.iter().map(|frame| format!("{:<1$}", part(frame), width(frame))).collect();
        format!("{}\n", cells.join("    ").trim_end())
    };
    let mut text = row(&|frame| frame.head.clone());
    for line in 0..height {
        text.push_str(&row(&|frame| frame.body.lines().nth(line).unwrap_or_default().to_owned()));
    }
    text
}

/// Lists the expectations of one moment, except the picture.
fn draw_facts(op: usize, record: &Record, expect: &Expect) -> String {
    let moment = if op == 0 { "reset".to_owned() } else { format!("operation {op}") };
    let mut facts = Vec::new();
    let mut add =
        |what: &str, value: Option<String>| facts.extend(value.map(|value| format!("{what} {value}")));
    add("cells", list(expect.cells.as_ref()));
    add("goals", list(expect.goals.as_ref()));
    add("active", list(expect.active.as_ref()));
    add("on goal", list(expect.on_goal.as_ref()));
    add("rewards", list(expect.rewards.as_ref()));
    add("terminated", list(expect.terminated.as_ref()));
    add("truncated", list(expect.truncated.as_ref()));
    add("caller's actions", list(expect.actions_after.as_ref()));
    add("xy", list(expect.xy.as_ref()));
    add("target_xy", list(expect.target_xy.as_ref()));
    add("global_xy", list(expect.global_xy.as_ref()));
    add("global_target_xy", list(expect.global_target_xy.as_ref()));
    add("derived", expect.derived.as_ref().map(|fields| serde_json::json!(fields).to_string()));
    add("foretold goals", list(expect.foretold.as_ref()));
    add("padded dtype", expect.padded_dtype.clone());
    add("taken back", expect.moved.map(|moved| moved.to_string()));
    add("changes", list(expect.changes.as_ref()));
    add("metrics", expect.metrics.and(record.step()).map(draw_metrics));
    let mut text = String::new();
    if !facts.is_empty() {
        let _ = writeln!(text, "\nafter {moment}: {}", facts.join("; "));
    }
    let pictures = [("occupancy", &expect.occupied), ("with its border", &expect.padded)];
    let frame = |(what, picture): (&str, &Option<String>)| {
        Some(Frame { head: format!("{what} after {moment}"), body: picture.as_ref()?.trim_end().to_owned() })
    };
    let frames: Vec<Frame> = pictures.into_iter().filter_map(frame).collect();
    if !frames.is_empty() {
        let _ = write!(text, "\n{}", side_by_side(&frames));
    }
    if let Some(sees) = &expect.sees {
        let _ = write!(text, "\n{}", draw_window(&moment, sees));
    }
    text
}

fn list<T: Serialize>(values: Option<&Vec<T>>) -> Option<String> {
    serde_json::to_string(values?).ok()
}

fn draw_metrics(step: &StepRecord) -> String {
    let Some(metrics) = step.step.metrics else { return "none".into() };
    metrics.named().iter().map(|(name, value)| format!("{name} {value}")).collect::<Vec<_>>().join(", ")
}

fn draw_window(moment: &str, sees: &Sees) -> String {
    let windows = [("obstacles", &sees.obstacles), ("agents", &sees.agents), ("goal", &sees.goal)];
    let frame = |(name, window): (&str, &Option<String>)| {
        let body = window.as_ref()?.lines().map(str::trim).collect::<Vec<_>>().join("\n");
        Some(Frame { head: name.into(), body })
    };
    let frames: Vec<Frame> = windows.into_iter().filter_map(frame).collect();
    format!("agent {} sees after {moment}:\n{}", sees.agent, side_by_side(&frames))
}
