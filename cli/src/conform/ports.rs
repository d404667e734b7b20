//! `pogema conform --port`: anyone's implementation against everything it claims.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use indicatif::ProgressBar;
use pogema_conformance::port::{
    Command, Link, Part, Plan, PortReport, Process, Profile, Subject, check_ports, check_traces,
    shrink_causes,
};
use pogema_core::Error;

use super::known::Leftover;
use super::outputs::Outputs;
use super::port_table;
use super::summary::{Verdict, score};
use crate::output::{check_writable, say, write_json};
use crate::words::word;

/// The exit status for a port that breaks the protocol.
const MISBEHAVED: u8 = 3;

#[derive(Args, Debug)]
#[command(next_help_heading = "Ports")]
pub struct Ports {
    /// Check the port that this command line starts, instead of our own engines; may be given several times
    #[arg(long = "port", value_name = "COMMAND")]
    commands: Vec<String>,
    /// Check only rules that match, such as `collide/soft*`
    #[arg(long, value_name = "PATTERN", requires = "commands", value_parser = glob::Pattern::new)]
    rules: Option<glob::Pattern>,
    /// Check only this profile; may be given several times
    #[arg(long = "profile", value_name = "PROFILE", requires = "commands", value_parser = word::<Profile>())]
    profiles: Vec<Profile>,
    /// Play only this part; may be given several times
    #[arg(long = "part", value_name = "PART", requires = "commands", value_parser = word::<Part>())]
    parts: Vec<Part>,
    /// Seconds that a port may take for one answer
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds)]
    timeout: f64,
    /// Play only this case; may be given several times
    #[arg(long = "case", value_name = "FILE", requires = "commands")]
    files: Vec<PathBuf>,
    /// How many cases are played side by side, each in a process of its own; one for each processor by default
    #[arg(long, value_name = "N", requires = "commands", value_parser = clap::value_parser!(u16).range(1..=256))]
    workers: Option<u16>,
    /// Check traces that a port wrote itself, in place of asking a port
    #[arg(long = "trace", value_name = "FILE", num_args = 1.., conflicts_with = "commands")]
    traces: Vec<PathBuf>,
    #[command(flatten)]
    outputs: Outputs,
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.001..=86_400.0).contains(seconds));
    seconds.ok_or_else(|| "expected seconds, 0.001 to 86400".to_owned())
}

/// What the port run shares with the run of our own engines.
pub struct Shared<'a> {
    pub cases: u64,
    pub seed: u64,
    pub json: Option<&'a PathBuf>,
    pub keep: &'a PathBuf,
    pub bar: &'a ProgressBar,
}

impl Ports {
    /// Whether ports, or what they wrote, are to be checked.
    pub fn is_asked(&self) -> bool {
        !self.commands.is_empty() || !self.traces.is_empty()
    }

    pub fn run(&self, shared: &Shared<'_>) -> Result<ExitCode, Error> {
        if self.traces.is_empty() { self.run_ports(shared) } else { self.run_traces(shared) }
    }

    fn run_traces(&self, shared: &Shared<'_>) -> Result<ExitCode, Error> {
        shared.json.map_or(Ok(()), |path| check_writable(path))?;
        let reports = [check_traces(&self.traces)?];
        let leftover = Leftover::default();
        shared.json.map_or(Ok(()), |path| write_json(path, &reports))?;
        say(&port_table::tell(&reports, &leftover))?;
        Ok(exit_code(&reports, &leftover))
    }

    fn run_ports(&self, shared: &Shared<'_>) -> Result<ExitCode, Error> {
        let known = self.outputs.check(self.commands.len(), shared.json.map(PathBuf::as_path))?;
        let timeout = Duration::from_secs_f64(self.timeout);
        let commands =
            self.commands.iter().map(|text| Command::new(text, timeout)).collect::<Result<Vec<_>, _>>()?;
        let subjects: Vec<Subject<'_>> = commands.iter().map(subject).collect();
        let plan = self.plan(shared);
        let mut reports =
            check_ports(&subjects, &plan, |total| shared.bar.set_length(total), &|| shared.bar.inc(1))?;
        let num_causes =
            reports.iter().flat_map(|report| &report.causes).filter(|cause| cause.rule.is_some()).count();
        shared.bar.reset();
        shared.bar.set_message("counterexamples made smaller");
        shared.bar.set_length(num_causes as u64);
        for (index, (subject, report)) in subjects.iter().zip(&mut reports).enumerate() {
            // Several ports fail in the same rules, and must not overwrite each other's cases.
            let folder = if subjects.len() == 1 {
                shared.keep.clone()
            } else {
                shared.keep.join(format!("{}", index + 1))
            };
            shrink_causes(subject, report, &plan, &folder, &|| shared.bar.inc(1))?;
        }
        shared.bar.finish_and_clear();
        known.mark(&mut reports);
        let leftover = known.leftover(&reports, &plan);
        shared.json.map_or(Ok(()), |path| write_json(path, &reports))?;
        self.outputs.write(&reports, &leftover)?;
        say(&port_table::tell(&reports, &leftover))?;
        Ok(exit_code(&reports, &leftover))
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
}

fn subject(command: &Command) -> Subject<'_> {
    Subject {
        command: command.text.clone(),
        start: Box::new(|| Process::start(command).map(|process| Box::new(process) as Box<dyn Link>)),
    }
}

fn exit_code(reports: &[PortReport], leftover: &Leftover) -> ExitCode {
    if reports.iter().any(|report| score(report).verdict() == Verdict::Misbehaves) {
        ExitCode::from(MISBEHAVED)
    } else if reports.iter().any(PortReport::diverges) || !leftover.stopped.is_empty() {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}
