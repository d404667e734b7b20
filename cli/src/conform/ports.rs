//! `pogema conform --port`: anyone's implementation against everything it claims.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use indicatif::ProgressBar;
use pogema_conformance::files;
use pogema_conformance::port::{Command, Link, Plan, PortReport, Process, Profile, Subject, check_ports, shrink_causes};
use pogema_core::Error;

use super::port_table;
use crate::output::{check_writable, say};

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
    #[arg(long = "profile", value_name = "PROFILE", requires = "commands", value_parser = profile)]
    profiles: Vec<Profile>,
    /// Seconds that a port may take for one answer
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds)]
    timeout: f64,
    /// Play only this case; may be given several times
    #[arg(long = "case", value_name = "FILE", requires = "commands")]
    files: Vec<PathBuf>,
    /// How many cases are played side by side, each in a process of its own; one for each processor by default
    #[arg(long, value_name = "N", requires = "commands", value_parser = clap::value_parser!(u16).range(1..=256))]
    workers: Option<u16>,
}

fn profile(word: &str) -> Result<Profile, String> {
    serde_json::from_value(word.into())
        .map_err(|_| "expected core, observations, metrics, seeding, history or policies".to_owned())
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
    /// Whether ports are to be checked.
    pub fn is_asked(&self) -> bool {
        !self.commands.is_empty()
    }

    pub fn run(&self, shared: &Shared<'_>) -> Result<ExitCode, Error> {
        shared.json.map_or(Ok(()), |path| check_writable(path))?;
        let timeout = Duration::from_secs_f64(self.timeout);
        let commands =
            self.commands.iter().map(|text| Command::new(text, timeout)).collect::<Result<Vec<_>, _>>()?;
        let subjects: Vec<Subject<'_>> = commands.iter().map(subject).collect();
        let plan = Plan {
            num_cases: shared.cases,
            seed: shared.seed,
            rules: self.rules.clone(),
            profiles: self.profiles.clone(),
            num_workers: self.workers.map(usize::from),
            files: self.files.clone(),
        };
        let mut reports =
            check_ports(&subjects, &plan, |total| shared.bar.set_length(total), &|| shared.bar.inc(1))?;
        shared.bar.finish_and_clear();
        for (index, (subject, report)) in subjects.iter().zip(&mut reports).enumerate() {
            // Several ports fail in the same rules, and must not overwrite each other's cases.
            let folder = if subjects.len() == 1 { shared.keep.clone() } else { shared.keep.join(format!("{}", index + 1)) };
            shrink_causes(subject, report, &plan, &folder, &|| ())?;
        }
        if let Some(path) = shared.json {
            let text = serde_json::to_vec_pretty(&reports).map_err(|error| Error::io(path, error))?;
            files::write(path, &text)?;
        }
        for report in &reports {
            say(&port_table::tell(report))?;
        }
        Ok(exit_code(&reports))
    }
}

fn subject(command: &Command) -> Subject<'_> {
    Subject {
        command: command.text.clone(),
        start: Box::new(|| Process::start(command).map(|process| Box::new(process) as Box<dyn Link>)),
    }
}

fn exit_code(reports: &[PortReport]) -> ExitCode {
    if reports.iter().any(PortReport::misbehaves) {
        ExitCode::from(MISBEHAVED)
    } else if reports.iter().any(PortReport::diverges) {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}
