//! `pogema bench`: measures steps, observations and resets per second, and compares them with filling memory and with
//! POGEMA.

mod show;
mod targets;
mod timing;
mod work;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use clap::Args;
use indicatif::ProgressBar;
use pogema_conformance::find_oracle_python;
use pogema_core::Error;
use serde::{Deserialize, Serialize};

use crate::interrupt::exit_on_ctrl_c;
use crate::output::{check_writable, print_line, progress_bar, write_json};

use targets::{Target, targets};
use work::{Speed, Work};

#[derive(Args, Clone, Debug)]
pub struct Bench {
    /// Also time POGEMA 1.4.0 in the same run; requires Python 3.11
    #[arg(long)]
    peers: bool,
    /// Folder of POGEMA 1.4.0; if it is missing there, this command installs it
    #[arg(long, value_name = "FOLDER", default_value = "target/oracle", requires = "peers")]
    oracle_folder: PathBuf,
    /// Measure only the rows whose names contain this text [default: all rows]
    #[arg(long, value_name = "TEXT", default_value = "", hide_default_value = true)]
    rows: String,
    /// Time per figure, in seconds; does not apply to POGEMA's figures
    #[arg(long, value_name = "S", default_value_t = 0.1)]
    seconds: f64,
    /// Number of measurement rounds; each figure is the best of all rounds; use more on a busy machine
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    rounds: u64,
    /// Write all figures to this file as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// One row of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    name: String,
    work: Work,
    speed: Speed,
    /// POGEMA's figures for the same work, where it was timed.
    pogema: Option<Peer>,
}

impl Row {
    fn measure(work: &Work, budget: Duration, python: Option<&Path>) -> Result<Self, Error> {
        let python = python.filter(|_| has_peer(work));
        let pogema = python.map(|python| time_pogema(python, work)).transpose()?;
        Ok(Self { name: work.name(), speed: work.measure(budget)?, work: work.clone(), pogema })
    }

    /// Takes the better figures from another measurement of the same work.
    fn improve(&mut self, other: &Self) {
        self.speed.improve(&other.speed);
        if let (Some(own), Some(other)) = (&mut self.pogema, other.pogema) {
            own.observations = own.observations.max(other.observations);
            own.resets = own.resets.max(other.resets);
        }
    }
}

/// POGEMA's observations and resets per second.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Peer {
    observations: f64,
    resets: f64,
}

/// All measurements of a run.
#[derive(Debug, Serialize)]
struct Report {
    machine: String,
    path: String,
    rows: Vec<Row>,
    targets: Vec<Target>,
}

/// The largest number of agents for which POGEMA is timed; with more, its resets take minutes.
const MAX_POGEMA_AGENTS: usize = 10_000;

impl Bench {
    pub fn run(&self) -> Result<(), Error> {
        self.json.as_deref().map_or(Ok(()), check_writable)?;
        let budget = Duration::try_from_secs_f64(self.seconds).ok().filter(|budget| !budget.is_zero());
        let budget = budget.ok_or_else(|| Error::argument("--seconds", self.seconds, "a time above 0"))?;
        let python = self.peers.then(|| find_oracle_python(&self.oracle_folder)).transpose()?;
        let works: Vec<_> = works().into_iter().filter(|work| work.name().contains(&self.rows)).collect();
        if works.is_empty() {
            return Err(Error::argument("--rows", &self.rows, "a part of a row's name, such as `64 agents`"));
        }
        let bar =
            progress_bar("{wide_bar} {pos}/{len} {msg}", self.rounds.saturating_mul(works.len() as u64));
        let rows = Arc::new(Mutex::new(Vec::new()));
        self.report_on_ctrl_c(Arc::clone(&rows), works.len(), bar.clone())?;
        for _ in 0..self.rounds {
            for (index, work) in works.iter().enumerate() {
                bar.set_message(work.name());
                let row = Row::measure(work, budget, python.as_deref())?;
                let mut rows = rows.lock().unwrap_or_else(PoisonError::into_inner);
                match rows.get_mut(index) {
                    Some(best) => best.improve(&row),
                    None => rows.push(row),
                }
                bar.inc(1);
            }
        }
        bar.finish_and_clear();
        let rows = rows.lock().unwrap_or_else(PoisonError::into_inner).clone();
        self.report(rows)
    }

    /// Reports on Ctrl-C what has been measured so far.
    fn report_on_ctrl_c(
        &self,
        rows: Arc<Mutex<Vec<Row>>>,
        num_all: usize,
        bar: ProgressBar,
    ) -> Result<(), Error> {
        let bench = self.clone();
        exit_on_ctrl_c(move || {
            bar.finish_and_clear();
            let rows = rows.lock().unwrap_or_else(PoisonError::into_inner).clone();
            let num_rows = rows.len();
            let reported = if rows.is_empty() { Ok(()) } else { bench.report(rows) };
            reported.map_or_else(
                |error| error.to_string(),
                |()| format!("{num_rows} of {num_all} rows were measured"),
            )
        })
    }

    fn report(&self, rows: Vec<Row>) -> Result<(), Error> {
        let path = pogema_fast::SimdPath::from_environment()?.to_string();
        let report =
            Report { machine: pogema_toolbox::machine().to_owned(), path, targets: targets(&rows), rows };
        self.json.as_deref().map_or(Ok(()), |path| write_json(path, &report))?;
        print_line(&show::tables(&report.machine, &report.path, &report.rows, &report.targets))
    }
}

/// Returns the work to measure: the paper's table, many agents on large maps, and batches.
fn works() -> Vec<Work> {
    let single = |num_agents, size, lifelong| Work { lanes: None, threads: 1, num_agents, size, lifelong };
    let mut works = Vec::new();
    for lifelong in [false, true] {
        for size in [32, 64] {
            works.extend([1, 32, 64].map(|num_agents| single(num_agents, size, lifelong)));
        }
    }
    works.push(single(10_000, 256, false));
    works.extend([1_000, 10_000, 100_000].map(|num_agents| single(num_agents, 3072, false)));
    for threads in [1, 2] {
        works.push(Work { threads, ..single(1_000_000, 3072, false) });
    }
    let batch = |lanes, threads| Work { lanes: Some(lanes), threads, ..single(64, 32, true) };
    works.extend([1, 16, 256, 4096].map(|lanes| batch(lanes, 1)));
    works.extend([16, 64, 256, 4096].map(|lanes| batch(lanes, 2)));
    works
}

fn has_peer(work: &Work) -> bool {
    work.lanes.is_none() && work.num_agents <= MAX_POGEMA_AGENTS && work.size <= 256
}

fn time_pogema(python: &Path, work: &Work) -> Result<Peer, Error> {
    const SCRIPT: &str = include_str!("pogema_speed.py");
    let failed = |error: &dyn std::fmt::Display| Error::io(python, format!("cannot time POGEMA: {error}"));
    let mut child = Command::new(python)
        .args(["-c", SCRIPT])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|error| failed(&error))?;
    let config = work.config().to_string();
    let sent = child.stdin.take().map_or(Ok(()), |mut input| input.write_all(config.as_bytes()));
    let output = child.wait_with_output().map_err(|error| failed(&error))?;
    if !output.status.success() {
        // The script has written its traceback to standard error.
        return Err(failed(&format!("the script ended with {}, expected 0", output.status)));
    }
    sent.map_err(|error| failed(&error))?;
    serde_json::from_slice(&output.stdout).map_err(|error| failed(&error))
}
