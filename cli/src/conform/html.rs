//! The report as a self-contained HTML page.

use pogema_conformance::panel::{Content, Grid, Limits, Moment, Panel, text_of_panels};
use pogema_conformance::port::{Cause, Example, PortReport, text_of};
use pogema_conformance::rules;
use pogema_core::{Error, shorten};
use serde_json::{Value, json};

use super::grid_svg::drawing;
use super::known::Leftover;
use super::summary::{
    self, NOT_REPEATED, OUTCOMES, Standing, causes_of, counts, fill, is_rule, names, score, shortened,
    spec_url, standing, times, title, verdict,
};

/// Limits of text pictures: a page can be scrolled, but has to open on a phone.
const LIMITS: Limits = Limits { rows: 64, columns: 128 };
/// Maximum length of a case in the page; longer ones are shortened. Units: characters.
const LONGEST_CASE: usize = 20_000;

/// The style of all pages.
pub const STYLE: &str = include_str!("page.css");

/// Returns the report as an HTML page.
pub fn page(reports: &[PortReport], leftover: &Leftover) -> Result<String, Error> {
    let names = names(reports);
    let unclaimed = |what: &str| {
        let count = |report: &PortReport| report.not_claimed.get(what).map_or(String::new(), u64::to_string);
        json!({"what": what, "counts": reports.iter().map(count).collect::<Vec<_>>()})
    };
    let page = json!({
        "style": STYLE,
        "images": "data:",
        "title": format!("{} and POGEMA 1.4.0", names.join(", ")),
        "outcomes": OUTCOMES,
        "ports": reports.iter().zip(&names).enumerate().map(port).collect::<Vec<_>>(),
        "rows": summary::rows(reports).into_iter().map(|rule| row(reports, rule)).collect::<Vec<_>>(),
        "unclaimed": summary::unclaimed(reports).into_iter().map(unclaimed).collect::<Vec<_>>(),
        "stopped": leftover.stopped,
        "not_played": leftover.not_played,
    });
    fill(concat!(include_str!("head.html"), include_str!("report.html")), page)
}

fn port((index, (report, name)): (usize, (&PortReport, &String))) -> Value {
    let score = score(report);
    let causes_that_are = |is_known: bool| {
        let causes = report.causes.iter().enumerate().filter(|(_, cause)| cause.known.is_some() == is_known);
        causes.map(|(number, cause)| cause_values(cause, &id(index, number), name)).collect::<Vec<_>>()
    };
    json!({
        "name": name,
        "title": title(report),
        "verdict": verdict(report),
        "class": score.verdict(),
        "passed": score.passed,
        "played": score.played,
        "num_not_run": report.num_not_run,
        "num_interrupted": report.num_interrupted,
        "new": causes_that_are(false),
        "known": causes_that_are(true),
    })
}

/// Returns the HTML id of the section of a cause in the page.
fn id(port: usize, cause: usize) -> String {
    format!("port-{}-cause-{}", port + 1, cause + 1)
}

/// Returns the address, within the page, of the first cause of a rule's failures. `class` is the class of a cell; if it
/// is not the class of a failure, returns `None`. `port` is the index of the report in the page.
pub fn anchor_of(report: &PortReport, port: usize, rule: &str, class: &str) -> Option<String> {
    if !["failed", "error", "known"].contains(&class) {
        return None;
    }
    let is_shown = |cause: &&Cause| match class {
        "failed" => cause.rule.is_some(),
        "error" => cause.rule.is_none(),
        _ => true,
    };
    let first = causes_of(report, rule).find(is_shown)?;
    let number = report.causes.iter().position(|cause| std::ptr::eq(cause, first))?;
    Some(format!("#{}", id(port, number)))
}

/// Returns a row of the table of rules: one cell per port and outcome.
fn row(reports: &[PortReport], rule: &str) -> Value {
    let cells = |(port, report): (usize, &PortReport)| {
        let is_known = standing(report, rule) == Standing::Known;
        let [failed, error] = if is_known { ["known"; 2] } else { ["failed", "error"] };
        let cells = counts(report, rule).into_iter().zip(["passed", failed, "unclaimed", error]);
        let url =
            |class: &str, count: &str| anchor_of(report, port, rule, class).filter(|_| !count.is_empty());
        cells
            .map(|(count, class)| json!({"class": class, "url": url(class, &count), "count": count}))
            .collect::<Vec<_>>()
    };
    json!({"rule": link(rule), "cells": reports.iter().enumerate().map(cells).collect::<Vec<_>>()})
}

/// Returns a rule and the address of its section in the spec.
pub fn link(rule: &str) -> Value {
    json!({"text": rule, "url": spec_url(rule).filter(|_| is_rule(rule))})
}

fn cause_values(cause: &Cause, id: &str, port: &str) -> Value {
    json!({
        "id": id,
        "rule": cause.rule.as_deref().map(link),
        "statement": cause.rule.as_deref().and_then(rules::statement_of),
        "what": cause.what,
        "when": cause.when,
        "times": times(cause),
        "shown_by": cause.cases.keys().map(|rule| link(rule)).collect::<Vec<_>>(),
        "example": cause.example.op().map(|_| &cause.example.name),
        "difference": difference(&cause.example),
        "case": cause.example.op().map(|_| case(&cause.example, port)),
        "fault": cause.example.fault.as_ref().map(ToString::to_string),
        "kept": cause.kept.as_ref().map(|path| path.display().to_string()),
        "replay": cause.replay,
        "note": (cause.is_repeated == Some(false)).then_some(NOT_REPEATED),
        "known": cause.known,
    })
}

fn case(example: &Example, port: &str) -> String {
    let case = text_of(example, port)
        .unwrap_or_else(|error| format!("# the case cannot be written as YAML: {error}"));
    shorten(&case, LONGEST_CASE)
}

fn difference(example: &Example) -> Option<Value> {
    let found = example.divergence.as_ref()?;
    Some(json!({
        "op": found.op,
        "field": found.field.to_string(),
        "expected": shortened(&found.expected),
        "got": shortened(&found.got),
        "drawings": drawings(&found.picture),
        "picture": text_of_panels(&found.picture, LIMITS),
    }))
}

/// Draws the state before the operation, the expected state and the state that the port sent, if they can be drawn.
fn drawings(panels: &[Panel]) -> Vec<Value> {
    let none = Grid::default();
    let grid = |moment: Moment| {
        let mut shown =
            panels.iter().filter(|panel| (panel.moment, panel.content) == (moment, Content::State));
        shown.next().and_then(|panel| panel.grids.first()).unwrap_or(&none)
    };
    let [before, expected, got] = [Moment::Before, Moment::Expected, Moment::Got].map(grid);
    [("before", before, &none), ("expected", expected, got), ("got", got, expected)]
        .into_iter()
        .filter_map(|(what, grid, other)| Some(json!({"what": what, "svg": drawing(what, grid, other)?})))
        .collect()
}
