//! The table of a run: ours beside the published figures, a row for each crowd.

use crate::output::markdown_table;
use crate::plan::Thinking;

use super::Record;
use super::published::{Mean, Solved};
use super::suite::Setting;

/// The episodes of one crowd, and what is known of it.
pub struct Crowd {
    pub set: &'static str,
    pub num_agents: usize,
    pub records: Vec<Record>,
    pub mean: Option<Mean>,
    pub solved: Option<Solved>,
}

impl Crowd {
    fn mean_of(&self, figure: impl Fn(&Record) -> Option<f64>) -> Option<f64> {
        mean(self.records.iter().filter_map(figure))
    }

    /// The means of a figure and of the published sums of costs, over the episodes that have both.
    fn beside_published(&self, figure: impl Fn(&Record) -> Option<f64>) -> Option<Both> {
        let Some(solved) = &self.solved else {
            let published = self.mean.as_ref().filter(|mean| mean.csr == Some(1.0))?.soc?;
            let all: Option<Vec<f64>> = self.records.iter().map(figure).collect();
            return Some(Both { ours: mean(all?.into_iter())?, published });
        };
        let place = |record: &Record| (record.num_agents, record.map.clone(), record.seed);
        let pair = |record: &Record| Some((figure(record)?, *solved.get(&place(record))?));
        let pairs: Vec<(f64, f64)> = self.records.iter().filter_map(pair).collect();
        Some(Both {
            ours: mean(pairs.iter().map(|pair| pair.0))?,
            published: mean(pairs.iter().map(|pair| pair.1))?,
        })
    }

    fn longest(&self) -> f64 {
        self.records.iter().map(|record| record.runtime).fold(0.0, f64::max)
    }
}

/// Means over the same episodes.
#[derive(Clone, Copy)]
struct Both {
    ours: f64,
    published: f64,
}

impl Both {
    fn ratio(self) -> f64 {
        self.ours / self.published
    }
}

fn mean(figures: impl Iterator<Item = f64>) -> Option<f64> {
    let figures: Vec<f64> = figures.collect();
    (!figures.is_empty()).then(|| figures.iter().sum::<f64>() / figures.len() as f64)
}

/// The table and what it is about, as Markdown.
pub fn tell(setting: Setting, planner: &str, thinking: &Thinking, crowds: &[Crowd]) -> String {
    let table = match setting {
        Setting::Mapf => mapf(crowds),
        Setting::Lmapf => lmapf(crowds),
    };
    let head = format!("{}, {planner}, {thinking}; every plan validated and replayed", setting.name());
    let impossible = crowds.iter().flat_map(|crowd| &crowd.records).filter_map(|record| {
        let reason = record.impossible.as_ref()?;
        Some(format!("{} with {} agents, seed {}: {reason}", record.map, record.num_agents, record.seed))
    });
    let impossible = impossible.map(|line| format!("\nimpossible: {line}"));
    format!("{head}\n\n{table}{}", impossible.collect::<Vec<_>>().concat())
}

fn mapf(crowds: &[Crowd]) -> comfy_table::Table {
    let mut table = markdown_table(&[
        "set",
        "agents",
        "episodes",
        "CSR",
        "published",
        "SoC if solved",
        "where both solve",
        "published",
        "times",
        "at least",
        "makespan",
        "published",
        "seconds",
        "longest",
    ]);
    for crowd in crowds {
        let published = |figure: fn(&Mean) -> Option<f64>| crowd.mean.as_ref().and_then(figure);
        let both = crowd.beside_published(Record::solved_soc);
        let bound = crowd.beside_published(|record| record.bound.map(|bound| bound as f64));
        table.add_row([
            crowd.set.to_owned(),
            crowd.num_agents.to_string(),
            crowd.records.len().to_string(),
            figure(crowd.mean_of(|record| record.csr), 4),
            figure(published(|mean| mean.csr), 4),
            figure(crowd.mean_of(Record::solved_soc), 2),
            figure(both.map(|both| both.ours), 2),
            figure(both.map(|both| both.published), 2),
            figure(both.map(Both::ratio), 4),
            figure(bound.map(Both::ratio), 4),
            figure(crowd.mean_of(|record| record.makespan), 2),
            figure(published(|mean| mean.makespan), 2),
            figure(crowd.mean_of(|record| Some(record.runtime)), 3),
            figure(Some(crowd.longest()), 3),
        ]);
    }
    table
}

fn lmapf(crowds: &[Crowd]) -> comfy_table::Table {
    let mut table = markdown_table(&[
        "set",
        "agents",
        "episodes",
        "throughput",
        "published",
        "times",
        "seconds",
        "published",
        "longest",
    ]);
    for crowd in crowds {
        let ours = crowd.mean_of(|record| record.throughput);
        let theirs = crowd.mean.as_ref().and_then(|mean| mean.avg_throughput);
        table.add_row([
            crowd.set.to_owned(),
            crowd.num_agents.to_string(),
            crowd.records.len().to_string(),
            figure(ours, 3),
            figure(theirs, 3),
            figure(ours.zip(theirs).map(|(ours, theirs)| ours / theirs), 3),
            figure(crowd.mean_of(|record| Some(record.runtime)), 3),
            figure(crowd.mean.as_ref().and_then(|mean| mean.runtime), 3),
            figure(Some(crowd.longest()), 3),
        ]);
    }
    table
}

fn figure(number: Option<f64>, digits: usize) -> String {
    number.map_or_else(String::new, |number| format!("{number:.digits$}"))
}
