//! `pogema conform`: checks every engine against recordings, cases and random episodes.

mod badge;
mod grid_svg;
mod html;
mod junit;
mod known;
mod outputs;
mod port_table;
mod ports;
mod site;
mod summary;

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use indicatif::ProgressBar;
use pogema_conformance::vectors::{self, Written};
use pogema_conformance::{NamedEngine, Report, Watch, cases, find_oracle_python, golden};
use pogema_core::{Error, counted};
use pogema_fast::SimdPath;

use crate::interrupt::Interrupt;
use crate::output::{check_writable, lined_table, print_line, progress_bar, write_json};

/// The number of divergences that are printed in full.
const MAX_SHOWN_FAILURES: usize = 5;

#[derive(Args, Debug)]
pub struct Conform {
    /// Number of random episodes
    #[arg(long, value_name = "N", default_value_t = 1000)]
    cases: u64,
    /// Seed of the random episodes
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Also compare the random episodes and the cases with POGEMA 1.4.0 itself; requires Python 3.11
    #[arg(long, conflicts_with_all = ports::OF_PORTS, conflicts_with_all = ["traces", "mib"])]
    oracle: bool,
    /// Folder of POGEMA 1.4.0; if it is missing there, this command installs it
    #[arg(long, value_name = "FOLDER", default_value = "target/oracle", requires = "oracle",
        conflicts_with_all = ports::OF_PORTS, conflicts_with_all = ["traces", "mib"])]
    oracle_folder: PathBuf,
    /// Write the full report to this file as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Folder for cases and episodes that diverge
    #[arg(long, value_name = "FOLDER", default_value = "pogema-found")]
    keep: PathBuf,
    /// Write the test vectors to this folder as JSON, and check nothing
    #[arg(long, value_name = "FOLDER", exclusive = true)]
    vectors: Option<PathBuf>,
    #[command(flatten)]
    ports: ports::Ports,
}

/// The fast engine.
const FAST: NamedEngine =
    NamedEngine { name: "fast", make: |config| Ok(Box::new(pogema_fast::Engine::new(config)?)) };

/// The engines of this project.
pub const ENGINES: [NamedEngine; 3] = [NamedEngine::REFERENCE, FAST, NamedEngine::LITERAL];

impl Conform {
    pub fn run(&self) -> Result<ExitCode, Error> {
        // Rejects an invalid `POGEMA_SIMD` now: it would make every episode of the fast engine a divergence.
        SimdPath::from_environment()?;
        if let Some(folder) = &self.vectors {
            let Written { num_rules, num_vectors } = vectors::write(folder)?;
            let folder = folder.display();
            print_line(&format!("wrote {num_vectors} vectors of {num_rules} rules to {folder}"))?;
            return Ok(ExitCode::SUCCESS);
        }
        let interrupt = Interrupt::watch()?;
        let stop = interrupt.flag();
        if self.ports.is_requested() {
            let bar = self.bar("cases");
            let shared = ports::Shared {
                cases: self.cases,
                seed: self.seed,
                json: self.json.as_ref(),
                keep: &self.keep,
                bar: &bar,
                stop: &stop,
            };
            let status = self.ports.run(&shared)?;
            return Ok(interrupt.status().unwrap_or(status));
        }
        self.json.as_deref().map_or(Ok(()), check_writable)?;
        let mut report = Report::default();
        let bar = progress_bar("{msg}: {pos}", 0).with_message("recordings and cases");
        let watch = Watch { progress: &|| bar.inc(1), stop: &stop };
        report.check_recordings("golden", &golden::folder(), &ENGINES, watch)?;
        report.check_recordings("found", &golden::found_folder(), &ENGINES, watch)?;
        report.check_cases("cases", &cases::folder(), &ENGINES, watch)?;
        bar.finish_and_clear();
        let bar = self.bar("random episodes");
        let watch = Watch { progress: &|| bar.inc(1), stop: &stop };
        report.check_fresh(&ENGINES, self.cases, self.seed, &self.keep, watch)?;
        bar.finish_and_clear();
        if self.oracle && !watch.is_stopped() {
            let python = find_oracle_python(&self.oracle_folder)?;
            let bar = progress_bar("{msg}: {pos}", 0).with_message("cases with POGEMA 1.4.0");
            let watch = Watch { progress: &|| bar.inc(1), stop: &stop };
            report.check_cases_with_oracle(&cases::folder(), &python, watch)?;
            bar.finish_and_clear();
            let bar = self.bar("random episodes with POGEMA 1.4.0");
            let watch = Watch { progress: &|| bar.inc(1), stop: &stop };
            report.check_oracle(&ENGINES[..2], &python, self.cases, self.seed, &self.keep, watch)?;
            bar.finish_and_clear();
        }
        if let Some(path) = &self.json {
            write_json(path, &report)?;
        }
        let mut text = report_text(&report);
        if watch.is_stopped() {
            let _ = write!(text, "\ninterrupted: only what is counted above was checked");
        }
        print_line(&text)?;
        let status = if report.agrees() { ExitCode::SUCCESS } else { ExitCode::FAILURE };
        Ok(interrupt.status().unwrap_or(status))
    }

    fn bar(&self, what: &'static str) -> ProgressBar {
        progress_bar("{msg} {wide_bar} {pos}/{len}, {eta} left", self.cases).with_message(what)
    }
}

/// Formats the report: tables, the first divergences, and the verdict.
fn report_text(report: &Report) -> String {
    let mut parts = lined_table(&["part", "checked", "failed"]);
    for part in &report.parts {
        parts.add_row([part.name.clone(), part.checked.to_string(), part.failed.to_string()]);
    }
    let mut rules = lined_table(&["rule", "comparisons", "diverged"]);
    for (rule, count) in &report.tally.rules {
        rules.add_row([rule.clone(), count.checked.to_string(), count.diverged.to_string()]);
    }
    let mut events = lined_table(&["event", "count"]);
    for (name, count) in report.events.named() {
        events.add_row([name.to_owned(), count.to_string()]);
    }
    let mut text = format!("{rules}\n\n{events}\n\n{parts}\n\n");
    for failure in report.failures.iter().take(MAX_SHOWN_FAILURES) {
        let _ = writeln!(text, "{}: {}\n{}", failure.part, failure.name, failure.text);
        if let Some(kept) = &failure.kept {
            let _ = writeln!(text, "kept as {}\n", kept.display());
        }
    }
    let verdict = match report.failures.len() {
        0 => "all agree: 0 divergences".into(),
        number => counted(number, "divergence"),
    };
    text.push_str(&verdict);
    text
}
