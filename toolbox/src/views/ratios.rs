//! One metric of all algorithms, divided by published means.

use std::path::{Path, PathBuf};

use pogema_core::Error;

use super::means::Means;
use super::options::{Common, NUM_AGENTS, Options};
use super::published::{by_num_agents, figure, ratio};
use super::table::{Cell, Table};
use super::{Shown, known_metric};
use crate::groups::lacking;
use crate::results::{COST, Results};
use crate::tree::Node;

/// `type: ratios`: the mean of a metric divided by the published mean, with a row for each folder and number of agents,
/// and a column for each algorithm.
///
/// `file` holds the published means of a `setting`. The datasets and algorithms in the file have the same names as the
/// folders and algorithms of the results. `metric` names the metric [default: `avg_throughput` with `LMAPF`, else
/// `ISR`]. `SoC` is compared only where the algorithm solves all instances in the results and in the published data.
#[derive(Clone, Debug)]
pub struct RatiosView {
    common: Common,
    file: PathBuf,
    setting: String,
    metric: String,
}

impl RatiosView {
    pub(super) fn read(name: &str, node: &Node) -> Result<Self, Error> {
        let options = Options::new(name, node, &["file", "setting", "metric"])?;
        let setting = options.required("setting")?;
        let default = match options.choice("setting", &["MAPF", "LMAPF"])? {
            Some("LMAPF") => "avg_throughput",
            _ => "ISR",
        };
        Ok(Self {
            common: Common::read(&options)?,
            file: options.required("file")?.into(),
            setting,
            metric: options.text("metric")?.unwrap_or_else(|| default.to_owned()),
        })
    }

    /// Resolves the path of the view's file relative to a folder.
    pub(super) fn beside(&mut self, folder: &Path) {
        self.file = folder.join(&self.file);
    }

    /// Reads the published means and divides the results by them.
    ///
    /// # Errors
    /// If the file cannot be read, if the results lack the metric, or if no algorithm has published means.
    pub(super) fn show(&self, name: &str, results: &Results) -> Result<Shown, Error> {
        known_metric(name, "metric", &self.metric, results)?;
        let means = Means::read(&self.file, std::slice::from_ref(&self.metric))?;
        let all = results.algorithms();
        let mut is_published = vec![false; all.len()];
        let mut lines = Vec::new();
        for (folder, rows) in results.by_folder() {
            for (num_agents, rows) in by_num_agents(rows) {
                let of = |(algorithm, is_published): (&String, &mut bool)| {
                    let own = rows.iter().copied().filter(|row| row.algorithm == *algorithm);
                    let mean =
                        |metric: &str| means.mean([&self.setting, folder, algorithm], num_agents, metric);
                    *is_published |= mean(&self.metric).is_some();
                    let figure = figure(&self.metric, &own.collect::<Vec<_>>(), None, mean);
                    ratio(figure.ours, figure.published)
                };
                let ratios: Vec<_> = all.iter().zip(&mut is_published).map(of).collect();
                lines.push((folder, num_agents, ratios));
            }
        }
        let (known, unknown): (Vec<usize>, Vec<usize>) = (0..all.len()).partition(|&at| is_published[at]);
        if known.is_empty() {
            let (file, all) = (self.file.display(), all.join(", "));
            let reason =
                format!("view `{name}`: `{file}` has no {} means of {all} in these folders", self.setting);
            return Err(Error::request(reason));
        }
        let unknown = unknown.iter().map(|&at| format!("`{}`: no published means", all[at]));
        let mut notes: Vec<String> = unknown.collect();
        if self.metric == COST {
            notes.push(format!(
                "`{COST}` is compared only where an algorithm solves all instances in both sources"
            ));
        }
        notes.extend(lacking(&results.rows, std::slice::from_ref(&self.metric)));
        let has_folders = lines.iter().any(|line| line.0 != lines[0].0);
        let mut head = Vec::new();
        head.extend(has_folders.then(|| "Folder".to_owned()));
        head.push(self.common.title(NUM_AGENTS));
        head.extend(known.iter().map(|&at| self.common.algorithm(&all[at])));
        let rows = lines.iter().map(|(folder, num_agents, ratios)| {
            let mut row = Vec::new();
            row.extend(has_folders.then(|| Cell::Text((*folder).to_owned())));
            row.push(Cell::Count(*num_agents as usize));
            row.extend(known.iter().map(|&at| Cell::Ratio(ratios[at])));
            row
        });
        let remark =
            format!("{} divided by the published mean, {}", self.common.title(&self.metric), self.setting);
        let table = Table {
            head,
            rows: rows.collect(),
            digits: self.common.digits,
            remark: Some(remark),
            ..Table::default()
        };
        Ok(Shown { tables: vec![table], notes, ..Shown::default() })
    }
}
