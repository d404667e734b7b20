//! `pogema conform --port`: checks ports against everything they claim.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use clap::Args;
use indicatif::ProgressBar;
use pogema_conformance::Watch;
use pogema_conformance::port::{
    Command, Link, Part, Plan, PortReport, Process, Profile, Subject, check_ports, check_traces,
    shrink_causes,
};
use pogema_core::Error;
use pogema_maps::did_you_mean;

use super::known::Leftover;
use super::outputs::Outputs;
use super::port_table;
use super::summary::{Verdict, rule_names, score};
use crate::input::Input;
use crate::output::{check_files, check_folder, print_line, write_json};
use crate::words::word;

/// The exit status if a port breaks the protocol.
const MISBEHAVES: u8 = 3;
/// Default time limit of an answer. Units: seconds.
const DEFAULT_TIMEOUT: f64 = 10.0;

/// The flags for runs on ports only. Runs on the built-in engines and checks of traces reject them.
pub const OF_PORTS: [&str; 8] =
    ["commands", "rules", "profiles", "parts", "timeout", "files", "workers", "Outputs"];
/// The flags that all runs accept. Checks of traces reject them.
const OF_RUNS: [&str; 3] = ["cases", "seed", "keep"];

#[derive(Args, Debug)]
#[command(
    next_help_heading = "Ports",
    mut_arg("mib", |limit| limit.requires("traces").conflicts_with_all(OF_PORTS).conflicts_with_all(OF_RUNS))
)]
pub struct Ports {
    /// Check the port that this command line starts, instead of the built-in engines; may be given several times
    #[arg(long = "port", value_name = "COMMAND")]
    commands: Vec<String>,
    /// Check only the rules that match a pattern, such as `collide/soft*` [default: all rules]
    #[arg(long, value_name = "PATTERN", requires = "commands", value_parser = rule_pattern)]
    rules: Option<glob::Pattern>,
    /// Check only this profile, and `core`; may be given several times [default: all profiles that the port claims]
    #[arg(long = "profile", value_name = "PROFILE", requires = "commands", value_parser = word::<Profile>())]
    profiles: Vec<Profile>,
    /// Play only this part; may be given several times [default: all parts]
    #[arg(long = "part", value_name = "PART", requires = "commands", value_parser = word::<Part>())]
    parts: Vec<Part>,
    /// Time limit for one answer of a port, in seconds; the first answer may take six times as long
    #[arg(long, value_name = "SECONDS", default_value_t = DEFAULT_TIMEOUT, requires = "commands", value_parser = seconds)]
    timeout: f64,
    /// Play only the case in this file; may be given several times
    #[arg(long = "case", value_name = "FILE", requires = "commands")]
    files: Vec<PathBuf>,
    /// Number of processes of a port that play cases in parallel [default: the number of processors]
    #[arg(long, value_name = "N", requires = "commands", value_parser = clap::value_parser!(u16).range(1..=256))]
    workers: Option<u16>,
    /// Check traces that a port wrote, instead of running a port
    #[arg(
        long = "trace",
        value_name = "FILE",
        num_args = 1..,
        conflicts_with_all = OF_PORTS,
        conflicts_with_all = OF_RUNS,
    )]
    traces: Vec<PathBuf>,
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    outputs: Outputs,
}

fn rule_pattern(text: &str) -> Result<glob::Pattern, String> {
    let pattern = glob::Pattern::new(text).map_err(|error| error.to_string())?;
    if rule_names().any(|rule| pattern.matches(rule)) {
        return Ok(pattern);
    }
    Err(format!("expected a pattern that matches a rule{}", did_you_mean(text, rule_names())))
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.001..=86_400.0).contains(seconds));
    seconds.ok_or_else(|| "expected seconds, 0.001 to 86400".to_owned())
}

/// The settings that runs on ports share with runs on the built-in engines.
pub struct Shared<'a> {
    pub cases: u64,
    pub seed: u64,
    pub json: Option<&'a PathBuf>,
    pub keep: &'a PathBuf,
    pub bar: &'a ProgressBar,
    /// The flag that Ctrl-C sets.
    pub stop: &'a Arc<AtomicBool>,
}

impl Ports {
    /// Returns whether ports or their traces are to be checked.
    pub fn is_requested(&self) -> bool {
        !self.commands.is_empty() || !self.traces.is_empty()
    }

    pub fn run(&self, shared: &Shared<'_>) -> Result<ExitCode, Error> {
        if self.traces.is_empty() { self.run_ports(shared) } else { self.run_traces(shared) }
    }

    fn run_traces(&self, shared: &Shared<'_>) -> Result<ExitCode, Error> {
        let traces: Vec<&Path> = self.traces.iter().map(PathBuf::as_path).collect();
        check_files(&traces, shared.json.map(|path| ("--json", path.as_path())))?;
        let reports = [check_traces(&self.traces, self.input.limit())?];
        let leftover = Leftover::default();
        shared.json.map_or(Ok(()), |path| write_json(path, &reports))?;
        print_line(&port_table::report_text(&reports, &leftover))?;
        Ok(exit_code(&reports, &leftover))
    }

    fn run_ports(&self, shared: &Shared<'_>) -> Result<ExitCode, Error> {
        let known =
            self.outputs.check(self.commands.len(), &self.files, shared.json.map(PathBuf::as_path))?;
        check_folder(shared.keep)?;
        let timeout = Duration::from_secs_f64(self.timeout);
        let commands =
            self.commands.iter().map(|text| Command::new(text, timeout)).collect::<Result<Vec<_>, _>>()?;
        let subjects: Vec<Subject<'_>> =
            commands.iter().map(|command| self.subject(command, shared.stop)).collect();
        let plan = self.plan(shared);
        let watch = Watch { progress: &|| shared.bar.inc(1), stop: shared.stop };
        let mut reports = check_ports(&subjects, &plan, |total| shared.bar.set_length(total), watch)?;
        let num_causes: usize = reports.iter().map(|report| report.causes.len()).sum();
        shared.bar.reset();
        shared.bar.set_message("shrinking counterexamples");
        shared.bar.set_length(num_causes as u64);
        let mut kept = Ok(());
        for (index, (subject, report)) in subjects.iter().zip(&mut reports).enumerate() {
            // Ports that fail the same rules must not overwrite each other's cases.
            let folder = if subjects.len() == 1 {
                shared.keep.clone()
            } else {
                shared.keep.join(format!("{}", index + 1))
            };
            kept = kept.and(shrink_causes(subject, report, &plan, &folder, watch));
        }
        shared.bar.finish_and_clear();
        known.mark(&mut reports);
        let leftover = known.leftover(&reports, &plan);
        // A file that cannot be written does not hide the report.
        let written = shared.json.map_or(Ok(()), |path| write_json(path, &reports));
        let written = written.and(self.outputs.write(&reports, &leftover));
        print_line(&port_table::report_text(&reports, &leftover))?;
        // The report is complete even if a case could not be kept.
        written.and(kept).map(|()| exit_code(&reports, &leftover))
    }

    fn plan(&self, shared: &Shared<'_>) -> Plan {
        Plan {
            num_cases: shared.cases,
            seed: shared.seed,
            rules: self.rules.clone(),
            profiles: self.profiles.clone(),
            num_workers: self.workers.map(usize::from),
            files: self.files.clone(),
            parts: self.parts.clone(),
        }
    }

    fn subject<'a>(&self, command: &'a Command, stop: &'a Arc<AtomicBool>) -> Subject<'a> {
        let mut replay = ["pogema", "conform", "--port", &command.text].map(str::to_owned).to_vec();
        if self.timeout != DEFAULT_TIMEOUT {
            replay.extend(["--timeout".to_owned(), self.timeout.to_string()]);
        }
        Subject {
            command: command.text.clone(),
            replay,
            start: Box::new(|| {
                let process = Process::start(command)?.stopped_by(Arc::clone(stop));
                Ok(Box::new(process) as Box<dyn Link>)
            }),
        }
    }
}

fn exit_code(reports: &[PortReport], leftover: &Leftover) -> ExitCode {
    if reports.iter().any(|report| score(report).verdict() == Verdict::Misbehaves) {
        ExitCode::from(MISBEHAVES)
    } else if reports.iter().any(|report| report.diverges() || score(report).verdict() == Verdict::Unchecked)
        || !leftover.stopped.is_empty()
    {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}
