//! `pogema replay`: replays an episode of an evaluation.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use pogema_core::{Error, counted};
use pogema_toolbox::{Pairs, Results, Suite, differences};

use crate::evaluate::environments;
use crate::maps::Sources;
use crate::output::{in_one_line, print_line, tell, write_trace};
use crate::render::Pictures;

#[derive(Args, Debug)]
pub struct Replay {
    /// Folder of results that `pogema evaluate` wrote
    folder: PathBuf,
    /// Algorithm, by its name in the results
    algorithm: String,
    /// Number of the episode; the first one of the suite is 0
    episode: usize,
    #[command(flatten)]
    sources: Sources,
    /// Write the trace of the episode to this file as JSON lines; compressed if its name ends in `.zst`
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    #[command(flatten)]
    pictures: Pictures,
}

impl Replay {
    pub fn run(&self) -> Result<(), Error> {
        let suite = Suite::of_results(&self.folder)?;
        let environments = environments(&suite, &self.sources)?;
        let num_agents = environments.at(self.episode)?.config.num_agents;
        self.pictures.check(num_agents, &[], &[("--trace", &self.trace)])?;
        let (metrics, trace) =
            suite.play_again(&environments, &self.algorithm, self.episode, &Arc::default())?;
        if let Some(path) = &self.trace {
            write_trace(path, &trace)?;
        }
        if self.pictures.are_requested() {
            let title = format!("{}, episode {}", self.algorithm, self.episode);
            self.pictures.draw(&trace, &title)?;
        }
        let figures = metrics.iter().filter_map(|(name, value)| Some((name.as_str(), value.as_f64()?)));
        print_line(&format!("{}  {}", counted(trace.steps.len(), "step"), in_one_line(figures)))?;
        self.compare(&metrics);
        Ok(())
    }

    /// Prints how the metrics differ from those in the results.
    fn compare(&self, metrics: &Pairs) {
        let results = Results::read(std::slice::from_ref(&self.folder));
        let note = |error| tell(&format!("note: cannot compare the replay with the results: {error}"));
        let Ok(results) = results.map_err(note) else { return };
        let row = results.rows.iter().filter(|row| row.algorithm == self.algorithm).nth(self.episode);
        let Some(row) = row else {
            let name = &self.algorithm;
            tell(&format!("note: cannot compare the replay with the results: `{name}` is not finished"));
            return;
        };
        for difference in differences(row, metrics) {
            tell(&format!("note: the replay differs from the results: {difference}"));
        }
    }
}
