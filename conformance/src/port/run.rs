//! One run of ports over everything that they claim.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use pogema_core::Error;
use serde::Serialize;

use super::claims::{Mode, Unclaimed, needed_by, profile_of};
use super::group::{self, Cause, Example};
use super::judge::{Judged, judge};
use super::keep::keep;
use super::link::{Link, Misbehaviour};
use super::protocol::{Hello, Profile};
use super::shrink::shrink;
use crate::cases::{self, Case};
use crate::compare::Divergence;
use crate::draw::draw_request;
use crate::golden::{self, Recording};
use crate::play::{Engine, play};
use crate::request::{Request, Response};
use crate::runner::{Progress, on_workers};
use crate::script::play_script;

/// After so many misbehaviours nothing more is asked of a port.
const MOST_FAULTS: u64 = 20;
/// The row of the table for what breaks no rule but the protocol.
const PROTOCOL_ROW: &str = "(protocol)";

/// A port and how a fresh one is started.
pub struct Subject<'a> {
    /// What it is called before it has said its name: its command line.
    pub command: String,
    /// Starts one; each worker does so, and again after each misbehaviour.
    pub start: Box<dyn Fn() -> Result<Box<dyn Link>, Misbehaviour> + Sync + 'a>,
}

/// What to check.
#[derive(Clone, Debug)]
pub struct Plan {
    /// How many cases to draw.
    pub num_cases: u64,
    /// Seed of the drawn cases.
    pub seed: u64,
    /// Only rules that this matches.
    pub rules: Option<glob::Pattern>,
    /// Only these profiles; all that are claimed, if there are none.
    pub profiles: Vec<Profile>,
    /// How many cases are played side by side; one for each processor, if none is given.
    pub num_workers: Option<usize>,
    /// These cases alone, and nothing else, if there are any.
    pub files: Vec<PathBuf>,
}

/// What a run shows of one port.
#[derive(Clone, Debug, Default, Serialize)]
pub struct PortReport {
    /// Its command line.
    pub command: String,
    /// Who it says it is.
    pub hello: Option<Hello>,
    /// By rule.
    pub rules: BTreeMap<String, Verdicts>,
    /// What is wrong, by cause.
    pub causes: Vec<Cause>,
    /// What was not claimed, and how many cases that left unchecked.
    pub not_claimed: BTreeMap<String, u64>,
    /// Cases that were played.
    pub num_played: u64,
    /// Steps in them.
    pub num_steps: u64,
    /// Cases that were not asked any more after too many misbehaviours.
    pub num_not_run: u64,
}

/// How cases of a rule came out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Verdicts {
    /// As the rule says.
    pub passed: u64,
    /// Otherwise.
    pub failed: u64,
    /// Not played, since the port does not claim it.
    pub not_claimed: u64,
    /// Not answered.
    pub errors: u64,
}

impl PortReport {
    /// Whether the port breaks a rule.
    pub fn diverges(&self) -> bool {
        self.causes.iter().any(|cause| cause.rule.is_some() && cause.known.is_none())
    }

    /// Whether the port broke the protocol.
    pub fn misbehaves(&self) -> bool {
        self.causes.iter().any(|cause| cause.rule.is_none() && cause.known.is_none())
    }

    fn row(&mut self, rule: &str) -> &mut Verdicts {
        self.rules.entry(rule.to_owned()).or_default()
    }
}

/// One thing to check.
enum Item {
    Case(String, Box<Case>),
    Recorded(String, Box<Recording>),
    Drawn(u64),
}

impl Item {
    fn name(&self, seed: u64) -> String {
        match self {
            Self::Case(name, _) | Self::Recorded(name, _) => name.clone(),
            Self::Drawn(number) => format!("drawn case {number} of seed {seed}"),
        }
    }

    fn case_rule(&self) -> Option<&str> {
        match self {
            Self::Case(_, case) => Some(&case.rule),
            Self::Recorded(..) | Self::Drawn(_) => None,
        }
    }

    fn request(&self, seed: u64) -> Result<(Request, Response), Error> {
        match self {
            Self::Case(_, case) => {
                let request = case.request()?;
                let expected = play(&request);
                Ok((request, expected))
            }
            Self::Recorded(_, recording) => Ok((recording.request.clone(), recording.response.clone())),
            Self::Drawn(number) => Ok(play_script(Engine::REFERENCE, draw_request(seed, *number), seed)),
        }
    }
}

/// What an item shows of one port.
struct Shown {
    subject: usize,
    name: String,
    case_rule: Option<String>,
    num_steps: u64,
    judged: Vec<(Mode, Judged)>,
    hello: Option<Hello>,
}

/// Checks ports, side by side.
///
/// # Errors
/// If a case or recording cannot be read.
pub fn check_ports(
    subjects: &[Subject<'_>],
    plan: &Plan,
    total: impl FnOnce(u64),
    progress: Progress<'_>,
) -> Result<Vec<PortReport>, Error> {
    let items = items(plan)?;
    let num_subjects = subjects.len() as u64;
    total(items.len() as u64 * num_subjects);
    let faults: Vec<AtomicU64> = subjects.iter().map(|_| AtomicU64::new(0)).collect();
    let shown = on_workers(
        plan.num_workers,
        items.len() as u64 * num_subjects,
        || Ok(subjects.iter().map(|_| None).collect::<Vec<Option<Running>>>()),
        |running, number| {
            let (item, subject) = (&items[(number / num_subjects) as usize], (number % num_subjects) as usize);
            let slot = &mut running[subject];
            let shown = show(&subjects[subject], subject, slot, &faults[subject], plan, item);
            progress();
            shown
        },
    )?;
    let blank = |subject: &Subject<'_>| PortReport { command: subject.command.clone(), ..PortReport::default() };
    let mut reports: Vec<PortReport> = subjects.iter().map(blank).collect();
    for shown in shown {
        take(&mut reports[shown.subject], shown, plan);
    }
    Ok(reports)
}

/// Makes the example of each cause as small as it can be and keeps it as a case.
///
/// # Errors
/// If a case cannot be written.
pub fn shrink_causes(
    subject: &Subject<'_>,
    report: &mut PortReport,
    plan: &Plan,
    folder: &Path,
    progress: Progress<'_>,
) -> Result<(), Error> {
    let mut slot = None;
    let name = report.hello.as_ref().map_or_else(|| report.command.clone(), |hello| hello.name.clone());
    for cause in report.causes.iter_mut().filter(|cause| cause.rule.is_some()) {
        // A port that cannot be started again leaves the example as it was.
        if let Ok(running) = running(subject, &mut slot, plan) {
            cause.example = shrink(running.link.as_mut(), &running.hello, &cause.example);
        }
        cause.kept = keep(&cause.example, &name, folder)?;
        cause.replay = cause.kept.as_ref().map(|path| {
            let quoted = shell_words::join([subject.command.as_str(), "--case", &path.display().to_string()]);
            format!("pogema conform --port {quoted}")
        });
        progress();
    }
    Ok(())
}

/// A started port.
struct Running {
    link: Box<dyn Link>,
    hello: Hello,
}

fn items(plan: &Plan) -> Result<Vec<Item>, Error> {
    let mut items = Vec::new();
    if !plan.files.is_empty() {
        for path in &plan.files {
            items.push(Item::Case(path.display().to_string(), Box::new(cases::read(path)?)));
        }
        return Ok(items);
    }
    let root = cases::folder();
    for path in golden::files(&root, ".yaml")? {
        let case = cases::read(&path)?;
        // Where POGEMA does something else by decision of this project, a port may do as POGEMA does.
        let is_asked = case.pogema.is_none() && plan.rules.as_ref().is_none_or(|rules| rules.matches(&case.rule));
        if is_asked {
            items.push(Item::Case(relative(&path, &root), Box::new(case)));
        }
    }
    for folder in [golden::folder(), golden::found_folder()] {
        for path in golden::recording_files(&folder)? {
            for (index, recording) in golden::read(&path)?.into_iter().enumerate() {
                let name = format!("{} line {}", relative(&path, &folder), index + 1);
                items.push(Item::Recorded(name, Box::new(recording)));
            }
        }
    }
    items.extend((0..plan.num_cases).map(Item::Drawn));
    Ok(items)
}

fn relative(path: &Path, root: &Path) -> String {
    path.strip_prefix(root.parent().unwrap_or(root)).unwrap_or(path).display().to_string()
}

fn show(
    subject: &Subject<'_>,
    index: usize,
    slot: &mut Option<Running>,
    faults: &AtomicU64,
    plan: &Plan,
    item: &Item,
) -> Result<Shown, Error> {
    let (request, expected) = item.request(plan.seed)?;
    let mut shown = Shown {
        subject: index,
        name: item.name(plan.seed),
        case_rule: item.case_rule().map(str::to_owned),
        num_steps: expected.records.iter().filter(|record| record.step().is_some()).count() as u64,
        judged: Vec::new(),
        hello: None,
    };
    for mode in [Mode::Instance, Mode::Config] {
        if faults.load(Ordering::Relaxed) >= MOST_FAULTS {
            break;
        }
        let running = match running(subject, slot, plan) {
            Ok(running) => running,
            Err(fault) => {
                faults.fetch_add(MOST_FAULTS, Ordering::Relaxed);
                shown.judged.push((mode, Judged { fault: Some(fault), request, ..Judged::default() }));
                break;
            }
        };
        shown.hello = Some(running.hello.clone());
        if !is_played_in(mode, &running.hello, plan, item) {
            continue;
        }
        let mut judged = match unclaimed_rule(&running.hello, item) {
            Some(unclaimed) => Judged { not_claimed: vec![unclaimed], ..Judged::default() },
            None => judge(running.link.as_mut(), &running.hello, mode, &request, &expected),
        };
        if let Item::Case(_, case) = item {
            // A case shows nothing of its rule without what the rule is about.
            let lacking = judged.not_claimed.iter().any(|unclaimed| unclaimed.covers(&case.rule));
            judged.is_played &= !lacking || !judged.divergences.is_empty();
        }
        if judged.fault.is_some() {
            faults.fetch_add(1, Ordering::Relaxed);
            *slot = None;
        }
        shown.judged.push((mode, judged));
    }
    Ok(shown)
}

fn running<'s>(
    subject: &Subject<'_>,
    slot: &'s mut Option<Running>,
    plan: &Plan,
) -> Result<&'s mut Running, Misbehaviour> {
    if let Some(running) = slot {
        return Ok(running);
    }
    let mut link = (subject.start)()?;
    let mut hello = link.hello()?;
    if !plan.profiles.is_empty() {
        hello.profiles.retain(|profile| *profile == Profile::Core || plan.profiles.contains(profile));
    }
    Ok(slot.insert(Running { link, hello }))
}

/// Whether an item is played in a mode: what is about drawing, from a config alone; the rest in every way there is.
fn is_played_in(mode: Mode, hello: &Hello, plan: &Plan, item: &Item) -> bool {
    let seeds = hello.profiles.contains(&Profile::Seeding);
    let only_seeding = plan.profiles.iter().all(|profile| *profile == Profile::Seeding) && !plan.profiles.is_empty();
    let is_about_seeding = item.case_rule().is_some_and(|rule| from_config_only(rule));
    match mode {
        Mode::Instance => !is_about_seeding && !only_seeding,
        // What is not claimed is noted once.
        Mode::Config => seeds || is_about_seeding,
    }
}

fn from_config_only(rule: &str) -> bool {
    profile_of(rule) == Profile::Seeding || rule == "seed/actions"
}

/// Why a hand-written case is not asked of a port at all.
fn unclaimed_rule(hello: &Hello, item: &Item) -> Option<Unclaimed> {
    let rule = item.case_rule()?;
    needed_by(hello, rule)
}

fn take(report: &mut PortReport, shown: Shown, plan: &Plan) {
    report.hello = report.hello.take().or(shown.hello);
    if shown.judged.is_empty() {
        report.num_not_run += 1;
        return;
    }
    let is_played = shown.judged.iter().any(|(_, judged)| judged.is_played);
    report.num_played += u64::from(is_played);
    report.num_steps += if is_played { shown.num_steps } else { 0 };
    let mut verdict = Verdicts::default();
    for (mode, judged) in shown.judged {
        for unclaimed in &judged.not_claimed {
            *report.not_claimed.entry(unclaimed.what.clone()).or_default() += 1;
            if shown.case_rule.is_none() {
                report.row(unclaimed.rule).not_claimed += 1;
            }
        }
        take_rows(report, shown.case_rule.as_deref(), &judged, plan);
        let Judged { request, divergences, fault, .. } = judged;
        let example = |divergence, fault| {
            let (name, request) = (shown.name.clone(), request.clone());
            Example { name, mode, request, divergence, fault }
        };
        let case = shown.case_rule.as_deref();
        for found in divergences.into_iter().filter(|found| case.is_some() || is_wanted(plan, &found.rule)) {
            let is_shown = case.filter(|rule| is_about(rule, &found));
            verdict.failed |= u64::from(is_shown.is_some());
            group::add(&mut report.causes, example(Some(found), None), is_shown);
        }
        if fault.is_some() {
            verdict.errors = 1;
            group::add(&mut report.causes, example(None, fault), case);
        }
    }
    if let Some(rule) = shown.case_rule {
        let row = report.row(&rule);
        match verdict {
            Verdicts { errors: 1.., .. } => row.errors += 1,
            Verdicts { failed: 1.., .. } => row.failed += 1,
            _ if is_played => row.passed += 1,
            _ => row.not_claimed += 1,
        }
    }
}

fn is_wanted(plan: &Plan, rule: &str) -> bool {
    plan.rules.as_ref().is_none_or(|rules| rules.matches(rule))
}

/// Counts what an item shows of the rules of its comparisons.
fn take_rows(report: &mut PortReport, case_rule: Option<&str>, judged: &Judged, plan: &Plan) {
    for found in judged.divergences.iter().filter(|found| is_wanted(plan, &found.rule)) {
        // A case counts for its own rule, once.
        if case_rule.is_none_or(|rule| !is_about(rule, found)) {
            report.row(&found.rule).failed += 1;
        }
    }
    if case_rule.is_some() {
        return;
    }
    report.row(PROTOCOL_ROW).errors += u64::from(judged.fault.is_some());
    for (rule, _) in judged.tally.rules.iter().filter(|(rule, count)| count.diverged == 0 && is_wanted(plan, rule)) {
        report.row(rule).passed += 1;
    }
}

/// Whether a difference says something of the rule of the case that it was seen in: every case is about states, and
/// otherwise about its own family.
fn is_about(case_rule: &str, found: &Divergence) -> bool {
    let family = |rule: &str| match rule.split('/').next().unwrap_or_default() {
        // Seen through the same windows.
        "border" | "occupancy" => "observe".to_owned(),
        other => other.to_owned(),
    };
    let is_of_state = ["cell", "goal", "active", "start", "action", "error"].contains(&found.kind().as_str());
    is_of_state || family(case_rule) == family(&found.rule)
}
