//! Checks of traces that a port wrote, for ports that cannot use a pipe.

use std::collections::BTreeSet;
use std::path::Path;

use pogema_core::{Error, InputLimit, Trace, counted};
use pogema_maps::GridConfig;

use super::claims::{Mode, Scope, Unclaimed};
use super::judge::Judged;
use super::plan::Plan;
use super::protocol::ReplyKey;
use super::report::{ItemResult, PortReport, add_result};
use crate::compare::compare_played;
use crate::files;
use crate::play::{NamedEngine, Player};
use crate::request::{Op, Record, Request, ResetRecord, Response, StepRecord, numbers};
use crate::tally::rules_of;

/// Plays the actions of each trace on the reference and compares the results with the trace.
///
/// `limit` bounds the length of the lines and the size of each file.
///
/// # Errors
/// [`Error::Io`] for a file that cannot be read or is not a trace.
pub fn check_traces(paths: &[impl AsRef<Path>], limit: InputLimit) -> Result<PortReport, Error> {
    let mut report = PortReport { command: counted(paths.len(), "trace"), ..PortReport::default() };
    let plan = Plan::default();
    for path in paths {
        let path = path.as_ref();
        let trace = Trace::read(files::open_within(path, limit)?).map_err(|error| Error::io(path, error))?;
        let judged = judge_trace(&trace).map_err(|error| Error::io(path, error))?;
        let result = ItemResult {
            subject: 0,
            name: path.display().to_string(),
            case_rule: None,
            num_steps: trace.steps.len() as u64,
            judged: vec![(Mode::Instance, judged)],
            is_cut_off: false,
            hello: None,
        };
        add_result(&mut report, result, &plan);
    }
    Ok(report)
}

fn judge_trace(trace: &Trace) -> Result<Judged, Error> {
    let (config, instance) = (&trace.header.config, trace.header.instance()?);
    let mut player =
        Player::of_instance(&NamedEngine::REFERENCE.make, config, instance, &metric_names(trace))?;
    let mut request = Request { config: player.config.to_value(), ..Request::default() };
    let (mut expected, mut got) = (Response::default(), Response::default());
    request.ops.push(Op::Reset(None));
    let begun = player.perform(&Op::Reset(None))?;
    let Record::Reset(reset) = &begun else { return Ok(Judged::default()) };
    let state = trace.start.state.clone();
    let observations = trace.start.observations.clone();
    got.records.push(Record::Reset(Box::new(ResetRecord { state, observations, ..reset.as_ref().clone() })));
    expected.records.push(begun);
    for step in &trace.steps {
        let op = Op::Step(numbers(&step.actions));
        expected.records.push(player.perform(&op)?);
        let (infos_active, actions_after) = (step.state.active.clone(), Vec::new());
        let step = step.clone();
        got.records.push(Record::Step(Box::new(StepRecord { step, actions_after, infos_active })));
        request.ops.push(op);
    }
    let not_claimed = left_out(trace, &player.config, &expected);
    let mut judged = Judged { is_played: true, not_claimed, ..Judged::default() };
    let scope = scope_of(trace);
    judged.divergences = compare_played(&scope, &player.config, &request, &expected, &got, &mut judged.tally);
    judged.request = request;
    Ok(judged)
}

/// Returns the names of all metrics that occur in a trace.
fn metric_names(trace: &Trace) -> Vec<String> {
    let metrics = trace.steps.iter().filter_map(|step| step.metrics).flat_map(|metrics| metrics.named());
    let names: BTreeSet<&str> = metrics.map(|(name, _)| name).collect();
    names.into_iter().map(str::to_owned).collect()
}

/// Returns the parts that a trace lacks in some frames, and that are therefore not compared. If no frame has
/// observations, none counts as missing.
fn left_out(trace: &Trace, config: &GridConfig, expected: &Response) -> Vec<Unclaimed> {
    let config_rules = rules_of(config);
    let has_any =
        trace.start.observations.is_some() || trace.steps.iter().any(|step| step.observations.is_some());
    let missing = |what: &str, step: usize| {
        Unclaimed::new(format!("{what}, missing after step {step}"), config_rules.observe)
    };
    let unseen = first_unseen(trace).filter(|_| has_any).map(|step| missing("observations", step));
    let unmeasured = expected.records.iter().zip(0..).find_map(|(record, step)| {
        let is_due = record.step()?.step.metrics.is_some() && metric_names(trace).is_empty();
        is_due.then(|| Unclaimed { rule: config_rules.metrics, ..missing("metrics", step) })
    });
    unseen.into_iter().chain(unmeasured).collect()
}

/// Returns the number of steps before the first frame without observations.
fn first_unseen(trace: &Trace) -> Option<usize> {
    let frames = std::iter::once(&trace.start.observations);
    frames.chain(trace.steps.iter().map(|step| &step.observations)).position(Option::is_none)
}

/// Returns the comparisons that apply to a trace. Observations are compared only if every frame has them.
fn scope_of(trace: &Trace) -> Scope {
    Scope {
        drawn: false,
        observations: first_unseen(trace).is_none(),
        metrics: Some(metric_names(trace)),
        tells: Some(vec![ReplyKey::OnGoal, ReplyKey::Occupied]),
    }
}
