//! Results beside published ones.

mod figure;
mod means;
mod set;
mod table;

use std::path::{Path, PathBuf};

use pogema_core::Error;
use pogema_maps::nearest;

use super::options::{Common, Options};
use super::{Shown, known_column};
use crate::frame::values;
use crate::results::{Results, Row};
use crate::six::instance;
use crate::tree::Node;

use figure::{COST, Figure, RUNTIME, SOLVED};
use means::Means;
use set::Set;
use table::{Line, table};

/// The settings of published results, each with the metrics that are compared by default.
const SETTINGS: [(&str, &[&str]); 2] =
    [("MAPF", &[SOLVED, COST, "makespan", RUNTIME]), ("LMAPF", &["avg_throughput", RUNTIME])];

/// `type: published`: means beside published means, a row for each folder and number of agents.
///
/// `file` has the published means of a `setting`, a `dataset` (by default the name of the folder of results) and an
/// `algorithm`, beside which stands `ours`. `episodes` is a folder with a folder of published results for each dataset.
/// With it, sums of costs are compared on the instances that both solve; without it, only where both solve all.
#[derive(Clone, Debug)]
pub struct PublishedView {
    common: Common,
    file: PathBuf,
    episodes: Option<PathBuf>,
    setting: &'static str,
    dataset: Option<String>,
    algorithm: String,
    ours: Option<String>,
    metrics: Vec<String>,
}

impl PublishedView {
    pub(super) fn read(name: &str, node: &Node) -> Result<Self, Error> {
        let known = ["file", "episodes", "setting", "dataset", "algorithm", "ours", "metrics"];
        let options = Options::new(name, node, &known)?;
        options.required("setting")?;
        let setting = options.choice("setting", &SETTINGS.map(|(setting, _)| setting))?;
        let found = SETTINGS.into_iter().find(|(known, _)| Some(*known) == setting);
        let (setting, usual) = found.unwrap_or(SETTINGS[0]);
        let usual = || usual.iter().map(|&metric| metric.to_owned()).collect();
        Ok(Self {
            common: Common::read(&options)?,
            file: options.required("file")?.into(),
            episodes: options.text("episodes")?.map(PathBuf::from),
            setting,
            dataset: options.text("dataset")?,
            algorithm: options.required("algorithm")?,
            ours: options.text("ours")?,
            metrics: options.words("metrics")?.unwrap_or_else(usual),
        })
    }

    /// Takes the paths of its files as relative to a folder.
    pub(super) fn beside(&mut self, folder: &Path) {
        self.file = folder.join(&self.file);
        self.episodes = self.episodes.as_ref().map(|path| folder.join(path));
    }

    /// Reads what is published, and compares.
    ///
    /// # Errors
    /// If a file cannot be read or lacks what the view names, or if the results do.
    pub(super) fn show(&self, name: &str, results: &Results) -> Result<Shown, Error> {
        for metric in &self.metrics {
            known_column(name, "metrics", metric, results)?;
        }
        let ours = self.ours(name, results)?;
        let means = Means::read(&self.file, &self.metrics)?;
        let rows = results.rows.iter().filter(|row| row.algorithm == ours);
        let (mut lines, mut notes) = (Vec::new(), Vec::new());
        for (folder, crowds) in Set::crowds(rows) {
            let dataset = self.dataset.as_deref().unwrap_or(folder);
            let keys = [self.setting, dataset, &self.algorithm];
            means.check(name, keys)?;
            let set = Set { folder, published: self.published(name, dataset)? };
            set.check_columns(name, crowds.values().flatten().copied())?;
            for (num_agents, rows) in crowds {
                let published = |metric: &str| means.mean(keys, num_agents, metric);
                lines.push(self.line(&set, num_agents, &rows, published, &mut notes));
            }
        }
        let remark = format!("`{ours}` beside the published `{}`, {}", self.algorithm, self.setting);
        let table = table(&self.common, &self.metrics, &lines, remark);
        Ok(Shown { tables: vec![table], notes, ..Shown::default() })
    }

    /// The algorithm of the results that is compared.
    fn ours(&self, name: &str, results: &Results) -> Result<String, Error> {
        let all = results.algorithms();
        let own = self.ours.as_ref().unwrap_or(&self.algorithm);
        match all.as_slice() {
            _ if all.contains(own) => Ok(own.clone()),
            [only] if self.ours.is_none() => Ok(only.clone()),
            _ => {
                let found = self.ours.as_ref().map(|ours| format!(", found `{ours}`")).unwrap_or_default();
                let known = all.join(", ");
                let reason = format!("view `{name}`: expected `ours`, one of {known}{found}");
                Err(Error::Request { reason })
            }
        }
    }

    /// The published rows of a dataset, if there is a folder of episodes.
    fn published(&self, name: &str, dataset: &str) -> Result<Option<Vec<Row>>, Error> {
        let Some(folder) = self.episodes.as_ref().map(|folder| folder.join(dataset)) else { return Ok(None) };
        let results = Results::read(std::slice::from_ref(&folder))?;
        let all = results.algorithms();
        if !all.contains(&self.algorithm) {
            let hint = nearest(&self.algorithm, all.iter().map(String::as_str)).unwrap_or_default();
            let (algorithm, folder) = (&self.algorithm, folder.display());
            let reason = format!(
                "view `{name}`: no `{algorithm}.json` in `{folder}`; the nearest one is `{hint}.json`"
            );
            return Err(Error::Request { reason });
        }
        Ok(Some(results.rows.into_iter().filter(|row| row.algorithm == self.algorithm).collect()))
    }

    fn line<'a>(
        &self,
        set: &Set<'a>,
        num_agents: u64,
        rows: &[&Row],
        published: impl Fn(&str) -> Option<f64>,
        notes: &mut Vec<String>,
    ) -> Line<'a> {
        let figure = |metric: &String| match (metric.as_str(), set.pairing(rows)) {
            (COST, Some(pairing)) => Figure::of_both_solved(&pairing),
            (COST, None) => {
                Figure::of_all_solved(rows, published(COST).filter(|_| published(SOLVED) == Some(1.0)))
            }
            _ => Figure::of_all(rows, metric, published(metric)),
        };
        let figures: Vec<Figure> = self.metrics.iter().map(figure).collect();
        let what = format!("`{}` with {num_agents} agents", set.folder);
        if !self.metrics.iter().any(|metric| published(metric).is_some()) {
            notes.push(format!("{what}: there are no published means"));
        }
        let cost = self.metrics.iter().position(|metric| metric == COST).map(|at| figures[at]);
        match set.pairing(rows) {
            Some(pairing) if pairing.pairs.is_empty() => {
                notes.push(format!("{what}: none of the instances is among the published episodes"));
            }
            None if cost.is_some_and(|cost| cost.published.is_none()) => {
                let why = "some instances are unsolved; `episodes` compares those that both solve";
                notes.push(format!("{what}: `{COST}` is not compared: {why}"));
            }
            _ => {}
        }
        notes.extend(rows.iter().filter_map(|row| {
            let reason = row.proof.unsolvable.as_ref()?;
            Some(format!("{}: proved unsolvable: {reason}", instance(row)))
        }));
        let longest = values(rows, RUNTIME).into_iter().reduce(f64::max);
        Line { folder: set.folder, num_agents, num_episodes: rows.len(), figures, longest }
    }
}
