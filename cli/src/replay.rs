//! `pogema replay`: an episode of results, played again.

use std::path::PathBuf;

use clap::Args;
use pogema_core::Error;
use pogema_toolbox::{Pairs, Results, Suite, differences};

use crate::evaluate::environments;
use crate::maps::Sources;
use crate::output::{check_writable, in_a_line, say, write_trace};
use crate::render::Pictures;

#[derive(Args, Debug)]
pub struct Replay {
    /// A folder of results that `pogema evaluate` wrote
    folder: PathBuf,
    /// Whose episode, by the name of its results
    algorithm: String,
    /// Its number: 0 is the first of the suite
    episode: usize,
    #[command(flatten)]
    sources: Sources,
    /// Write what happened to this file, as JSON lines; compressed if it ends in `.zst`
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    #[command(flatten)]
    pictures: Pictures,
}

impl Replay {
    pub fn run(&self) -> Result<(), Error> {
        let suite = Suite::of_results(&self.folder)?;
        let environments = environments(&suite, &self.sources)?;
        self.trace.as_deref().map_or(Ok(()), check_writable)?;
        self.pictures.check(environments.at(self.episode)?.config.num_agents)?;
        let (metrics, trace) = suite.play_again(&environments, &self.algorithm, self.episode)?;
        if let Some(path) = &self.trace {
            write_trace(path, &trace)?;
        }
        if self.pictures.are_wanted() {
            let title = format!("{}, episode {}", self.algorithm, self.episode);
            self.pictures.draw(&trace, &title)?;
        }
        let figures = metrics.iter().filter_map(|(name, value)| Some((name.as_str(), value.as_f64()?)));
        say(&format!("{} steps  {}", trace.steps.len(), in_a_line(figures)))?;
        self.compare(&metrics);
        Ok(())
    }

    /// Says in what the episode differs from what is in the results.
    fn compare(&self, metrics: &Pairs) {
        let results = Results::read(std::slice::from_ref(&self.folder));
        let note = |error| eprintln!("note: nothing to compare it with: {error}");
        let Ok(results) = results.map_err(note) else { return };
        let row = results.rows.iter().filter(|row| row.algorithm == self.algorithm).nth(self.episode);
        let Some(row) = row else {
            eprintln!("note: `{}` is not finished, so there is nothing to compare it with", self.algorithm);
            return;
        };
        for difference in differences(row, metrics) {
            eprintln!("note: it came out otherwise: {difference}");
        }
    }
}
