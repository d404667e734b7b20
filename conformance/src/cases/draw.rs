//! A case as a text picture, for the spec.

use std::fmt::Write as _;

use pogema_core::{Map, picture};
use serde_json::Value;

use super::{Case, CaseStep, Sees};
use crate::request::{Record, Response, StepRecord};

/// Frames in one row of a picture.
const FRAMES_ABREAST: usize = 4;

impl Case {
    /// The case as text: its sentence, its config, what happens, and what it checks besides.
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
        for abreast in frames.chunks(FRAMES_ABREAST) {
            text.push('\n');
            text.push_str(&beside(abreast));
        }
        let expectations = std::iter::once(&self.start).chain(self.steps.iter().map(|step| &step.expect));
        for (op, (record, expect)) in response.records.iter().zip(expectations).enumerate() {
            if let Some(sees) = &expect.sees {
                let _ = write!(text, "\n{}", draw_window(op, sees));
            }
            if let Some(metrics) = record.step().and_then(|step| step.step.metrics)
                && expect.metrics.is_some()
            {
                let figures: Vec<String> =
                    metrics.named().iter().map(|(name, value)| format!("{name} {value}")).collect();
                let _ = writeln!(text, "\nafter step {op}: {}", figures.join(", "));
            }
        }
        if let Some(error) = &response.error {
            let _ = writeln!(text, "\nerror: {}", error.message);
        }
        if let Some(pogema) = &self.pogema {
            let _ = writeln!(text, "\nPOGEMA 1.4.0: {pogema}");
        }
        text.trim_end().to_owned()
    }

    /// The config but for a map that the frames show anyway.
    fn draw_config(&self) -> String {
        let Some(fields) = self.config.as_object() else { return String::new() };
        let is_text = |value: &Value| value.as_str().is_some_and(|text| text.contains('\n'));
        let lines = fields.iter().map(|(field, value)| match value.as_str() {
            Some(rows) if is_text(value) => {
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
        (_, Record::History(_)) => "history".into(),
        (_, Record::Odd(_)) => "?".into(),
    }
}

/// Frames side by side, each under what led to it.
fn beside(frames: &[Frame]) -> String {
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

fn draw_window(op: usize, sees: &Sees) -> String {
    let windows = [("obstacles", &sees.obstacles), ("agents", &sees.agents), ("goal", &sees.goal)];
    let frame = |(name, window): (&str, &Option<String>)| {
        let body = window.as_ref()?.lines().map(str::trim).collect::<Vec<_>>().join("\n");
        Some(Frame { head: name.into(), body })
    };
    let frames: Vec<Frame> = windows.into_iter().filter_map(frame).collect();
    let moment = if op == 0 { "reset".to_owned() } else { format!("step {op}") };
    format!("agent {} sees after {moment}:\n{}", sees.agent, beside(&frames))
}
