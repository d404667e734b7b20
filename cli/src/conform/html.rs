//! The report as one page that needs nothing else.

use pogema_conformance::panel::{Content, Grid, Limits, Moment, Panel, text_of_panels};
use pogema_conformance::port::{Cause, Example, PortReport, text_of};
use pogema_conformance::{Record, agents_grid, play};
use pogema_core::{Error, Snapshot, Words, shorten};
use serde::Serialize;

use super::grid_svg::drawing;
use super::known::Leftover;
use super::summary::{
    self, OUTCOMES, Standing, counts, is_rule, names, score, shortened, spec_url, standing, times, title,
    verdict,
};
use super::template::fill;

/// A page can be scrolled, but should open on a phone.
const LIMITS: Limits = Limits { rows: 64, columns: 128 };
/// A longer case is better read in its file. Units: characters.
const LONGEST_CASE: usize = 20_000;

/// All that the page shows.
#[derive(Serialize)]
struct Page {
    title: String,
    outcomes: [&'static str; 4],
    ports: Vec<Port>,
    rows: Vec<Row>,
    unclaimed: Vec<Unclaimed>,
    stopped: Vec<String>,
    not_played: Vec<String>,
}

#[derive(Serialize)]
struct Port {
    name: String,
    title: String,
    verdict: String,
    class: &'static str,
    passed: usize,
    claimed: usize,
    num_not_run: u64,
    new: Vec<ShownCause>,
    known: Vec<ShownCause>,
}

#[derive(Serialize)]
struct Row {
    rule: Link,
    /// For each port, each outcome.
    cells: Vec<Vec<Cell>>,
}

#[derive(Serialize)]
struct Cell {
    class: &'static str,
    count: String,
}

#[derive(Serialize)]
struct Unclaimed {
    what: String,
    counts: Vec<String>,
}

#[derive(Serialize)]
struct Link {
    text: String,
    url: Option<String>,
}

#[derive(Serialize)]
struct ShownCause {
    rule: Option<Link>,
    what: String,
    times: String,
    shown_by: Vec<Link>,
    example: String,
    difference: Option<Difference>,
    fault: Option<String>,
    kept: Option<String>,
    replay: Option<String>,
    known: Option<String>,
}

#[derive(Serialize)]
struct Difference {
    op: usize,
    field: String,
    expected: String,
    got: String,
    drawings: Vec<Drawing>,
    picture: String,
    case: String,
}

#[derive(Serialize)]
struct Drawing {
    what: &'static str,
    svg: String,
}

/// The report as a page.
pub fn page(reports: &[PortReport], leftover: &Leftover) -> Result<String, Error> {
    let names = names(reports);
    let page = Page {
        title: format!("{} and POGEMA 1.4.0", names.join(", ")),
        outcomes: OUTCOMES,
        ports: reports.iter().zip(&names).map(|(report, name)| port(report, name)).collect(),
        rows: summary::rows(reports).into_iter().map(|rule| row(reports, rule)).collect(),
        unclaimed: summary::unclaimed(reports).into_iter().map(|what| unclaimed(reports, what)).collect(),
        stopped: leftover.stopped.clone(),
        not_played: leftover.not_played.clone(),
    };
    fill(include_str!("report.html"), page)
}

fn port(report: &PortReport, name: &str) -> Port {
    let score = score(report);
    let (known, new) = report.causes.iter().partition::<Vec<&Cause>, _>(|cause| cause.known.is_some());
    let shown_causes = |causes: Vec<&Cause>| causes.into_iter().map(|cause| shown(cause, name)).collect();
    Port {
        name: name.to_owned(),
        title: title(report),
        verdict: verdict(report),
        class: score.verdict().word(),
        passed: score.passed,
        claimed: score.claimed,
        num_not_run: report.num_not_run,
        new: shown_causes(new),
        known: shown_causes(known),
    }
}

fn row(reports: &[PortReport], rule: &str) -> Row {
    let cells = |report: &PortReport| {
        let is_known = standing(report, rule) == Standing::Known;
        let [failed, error] = if is_known { ["known"; 2] } else { ["failed", "error"] };
        let classes = ["passed", failed, "unclaimed", error];
        counts(report, rule).into_iter().zip(classes).map(|(count, class)| Cell { class, count }).collect()
    };
    Row { rule: link(rule), cells: reports.iter().map(cells).collect() }
}

fn unclaimed(reports: &[PortReport], what: &str) -> Unclaimed {
    let count = |report: &PortReport| report.not_claimed.get(what).map_or(String::new(), u64::to_string);
    Unclaimed { what: what.to_owned(), counts: reports.iter().map(count).collect() }
}

fn link(rule: &str) -> Link {
    Link { text: rule.to_owned(), url: spec_url(rule).filter(|_| is_rule(rule)) }
}

fn shown(cause: &Cause, port: &str) -> ShownCause {
    ShownCause {
        rule: cause.rule.as_deref().map(link),
        what: cause.what.clone(),
        times: times(cause),
        shown_by: cause.cases.keys().map(|rule| link(rule)).collect(),
        example: cause.example.name.clone(),
        difference: difference(&cause.example, port),
        fault: cause.example.fault.as_ref().map(ToString::to_string),
        kept: cause.kept.as_ref().map(|path| path.display().to_string()),
        replay: cause.replay.clone(),
        known: cause.known.clone(),
    }
}

fn difference(example: &Example, port: &str) -> Option<Difference> {
    let found = example.divergence.as_ref()?;
    let case =
        text_of(example, port).unwrap_or_else(|error| format!("# it cannot be written as YAML: {error}"));
    Some(Difference {
        op: found.op,
        field: found.field.to_string(),
        expected: shortened(&found.expected),
        got: shortened(&found.got),
        drawings: drawings(example, &found.picture, found.op),
        picture: text_of_panels(&found.picture, LIMITS),
        case: shorten(&case, LONGEST_CASE),
    })
}

/// The states before, as expected and as they came, as far as they can be drawn.
fn drawings(example: &Example, told: &[Panel], op: usize) -> Vec<Drawing> {
    let played = play(&example.request);
    let Some(map) = played.map_at(op) else { return Vec::new() };
    let expected = played.records.get(op).and_then(Record::state);
    let grid = |state: Option<&Snapshot>| state.map_or(Grid::new(), |state| agents_grid(&map, state));
    let [before, expected] = [played.state_before(op), expected].map(grid);
    let came = |panel: &&Panel| (panel.moment, panel.content) == (Moment::Got, Content::State);
    let got = told.iter().find(came).and_then(|panel| panel.grids.first().cloned()).unwrap_or_default();
    let drawn = [("before", &before, &Grid::new()), ("expected", &expected, &got), ("got", &got, &expected)];
    let drawn = drawn
        .into_iter()
        .filter_map(|(what, grid, other)| Some(Drawing { what, svg: drawing(what, grid, other)? }));
    drawn.collect()
}
