//! Comparison of results with published ones.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use pogema_core::{Error, counted};
use pogema_maps::did_you_mean;
use serde_json::Value;

use super::means::Means;
use super::options::{Common, NUM_AGENTS, Options};
use super::pairing::Pairing;
use super::table::{Cell, Table};
use super::{Shown, decisions, known_metric};
use crate::bootstrap::{Estimate, Spread, mean_of};
use crate::groups::{shown, values};
use crate::results::{COST, RUNTIME, Results, Row, SOLVED};
use crate::six::instance;
use crate::tree::Node;

/// `type: published`: means next to published means, with a row for each folder and number of agents.
///
/// `file` holds the published means of a `setting`, a `dataset` [default: the name of the folder of results] and an
/// `algorithm`, which is compared with the algorithm `ours` of the results. `episodes` is a folder with a folder of
/// published results for each dataset. With this folder, sums of costs are compared on the instances that both
/// algorithms solve; without it, only if both algorithms solve all instances.
///
/// `show_std` shows half the width of the 95 % interval next to each of our means, except that of the sums of costs.
/// `decision_times` adds columns with the planner's and the network's time for one action of one agent.
#[derive(Clone, Debug)]
pub struct PublishedView {
    common: Common,
    file: PathBuf,
    episodes: Option<PathBuf>,
    setting: String,
    dataset: Option<String>,
    algorithm: String,
    ours: Option<String>,
    metrics: Vec<String>,
    shows_intervals: bool,
    shows_decisions: bool,
}

/// A row of the table before it is formatted.
struct Line<'a> {
    folder: &'a str,
    num_agents: u64,
    rows: Vec<&'a Row>,
    /// The figures in the order of the metrics.
    figures: Vec<Figure>,
}

/// Our mean of a metric, and the published mean.
pub(super) struct Figure {
    pub ours: Option<f64>,
    pub published: Option<f64>,
    /// A lower bound on the ratio, for any planner.
    at_least: Option<f64>,
}

impl PublishedView {
    pub(super) fn read(name: &str, node: &Node) -> Result<Self, Error> {
        let known = [
            "file",
            "episodes",
            "setting",
            "dataset",
            "algorithm",
            "ours",
            "metrics",
            "show_std",
            "decision_times",
        ];
        let options = Options::new(name, node, &known)?;
        let setting = options.required("setting")?;
        let usual: &[&str] = match options.choice("setting", &["MAPF", "LMAPF"])? {
            Some("LMAPF") => &["avg_throughput", RUNTIME],
            _ => &[SOLVED, COST, "makespan", RUNTIME],
        };
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
            shows_intervals: options.flag("show_std")?.unwrap_or(false),
            shows_decisions: options.flag("decision_times")?.unwrap_or(false),
        })
    }

    /// Resolves the paths of the view's files relative to a folder.
    pub(super) fn beside(&mut self, folder: &Path) {
        self.file = folder.join(&self.file);
        self.episodes = self.episodes.as_ref().map(|path| folder.join(path));
    }

    /// Reads the published data and compares the results with them.
    ///
    /// # Errors
    /// If a file cannot be read, or if a file or the results lack what the view names.
    pub(super) fn show(&self, name: &str, results: &Results) -> Result<Shown, Error> {
        for metric in &self.metrics {
            known_metric(name, "metrics", metric, results)?;
        }
        let ours = self.ours(name, results)?;
        let means = Means::read(&self.file, &self.metrics)?;
        let (mut lines, mut notes) = (Vec::new(), Vec::new());
        for (folder, mut rows) in results.by_folder() {
            rows.retain(|row| row.algorithm == ours);
            if rows.is_empty() {
                continue;
            }
            let dataset = self.dataset.as_deref().unwrap_or(folder);
            let keys = [&self.setting, dataset, &self.algorithm];
            means.check(name, keys)?;
            let published = self.published(name, dataset)?;
            published.as_deref().map_or(Ok(()), |published| check_columns(name, &rows, published))?;
            for (num_agents, rows) in by_num_agents(rows) {
                let pairing = published.as_deref().map(|published| pair(&rows, published));
                let mean = |metric: &str| means.mean(keys, num_agents, metric);
                let figures = self.metrics.iter().map(|metric| figure(metric, &rows, pairing.as_ref(), mean));
                let line = Line { folder, num_agents, figures: figures.collect(), rows };
                notes.extend(self.notes(&line, pairing.as_ref(), mean));
                lines.push(line);
            }
        }
        let remark = format!("`{ours}` compared with the published `{}`, {}", self.algorithm, self.setting);
        Ok(Shown { tables: vec![self.table(&lines, remark)], notes, ..Shown::default() })
    }

    /// Returns the algorithm of the results that is compared.
    fn ours(&self, name: &str, results: &Results) -> Result<String, Error> {
        let all = results.algorithms();
        let own = self.ours.as_ref().unwrap_or(&self.algorithm);
        match all.as_slice() {
            _ if all.contains(own) => Ok(own.clone()),
            [only] if self.ours.is_none() => Ok(only.clone()),
            _ => {
                let found = self.ours.as_ref().map(|ours| format!(", found `{ours}`")).unwrap_or_default();
                let known = all.join(", ");
                Err(Error::request(format!("view `{name}`: expected `ours`, one of {known}{found}")))
            }
        }
    }

    /// Reads the published rows of a dataset, if the view has a folder of episodes.
    fn published(&self, name: &str, dataset: &str) -> Result<Option<Vec<Row>>, Error> {
        let Some(folder) = self.episodes.as_ref().map(|folder| folder.join(dataset)) else { return Ok(None) };
        let results = Results::read(std::slice::from_ref(&folder))?;
        let (all, algorithm) = (results.algorithms(), &self.algorithm);
        if !all.contains(algorithm) {
            let hint = did_you_mean(algorithm, all.iter().map(String::as_str));
            let folder = folder.display();
            let reason = format!("view `{name}`: `{folder}` has no results of `{algorithm}`{hint}");
            return Err(Error::request(reason));
        }
        Ok(Some(results.rows.into_iter().filter(|row| row.algorithm == *algorithm).collect()))
    }

    /// Returns notes on figures of a line that are not compared, and on instances that are proved unsolvable.
    fn notes(
        &self,
        line: &Line<'_>,
        pairing: Option<&Pairing<'_>>,
        mean: impl Fn(&str) -> Option<f64>,
    ) -> Vec<String> {
        let what = format!("`{}` with {}", line.folder, counted(line.num_agents as usize, "agent"));
        let mut notes = Vec::new();
        if !self.metrics.iter().any(|metric| mean(metric).is_some()) {
            notes.push(format!("{what}: no published means"));
        }
        let mut figures = self.metrics.iter().zip(&line.figures);
        let lacks_cost = figures.any(|(metric, figure)| metric == COST && figure.published.is_none());
        if pairing.is_some_and(|pairing| pairing.pairs.is_empty()) {
            notes.push(format!("{what}: none of the instances is among the published episodes"));
        } else if pairing.is_none() && lacks_cost && mean(COST).is_some() {
            let why = "some instances are unsolved; set `episodes` to compare the instances that both algorithms solve";
            notes.push(format!("{what}: `{COST}` is not compared: {why}"));
        }
        let unsolvable = line.rows.iter().filter_map(|row| Some((row, row.proof.unsolvable.as_ref()?)));
        notes.extend(unsolvable.map(|(row, why)| format!("{}: proved unsolvable: {why}", instance(row))));
        notes
    }

    /// Makes the table, without columns for published means or bounds that no line has.
    fn table(&self, lines: &[Line<'_>], remark: String) -> Table {
        let mut columns: Vec<(String, Vec<Cell>)> = Vec::new();
        let mut add = |title: &str, cell: &dyn Fn(&Line<'_>) -> Cell| {
            columns.push((title.to_owned(), lines.iter().map(cell).collect()));
        };
        if lines.iter().any(|line| line.folder != lines[0].folder) {
            add("Folder", &|line| Cell::Text(line.folder.to_owned()));
        }
        add(&self.common.title(NUM_AGENTS), &|line| Cell::Count(line.num_agents as usize));
        add("Episodes", &|line| Cell::Count(line.rows.len()));
        for (at, metric) in self.metrics.iter().enumerate() {
            let title = self.common.title(metric);
            let number = if [SOLVED, "ISR"].contains(&metric.as_str()) { Cell::Ratio } else { Cell::Number };
            add(&title, &|line| match metric.as_str() {
                metric if self.shows_intervals && metric != COST => Cell::Mean(interval(line, metric)),
                _ => number(line.figures[at].ours),
            });
            if lines.iter().any(|line| line.figures[at].published.is_some()) {
                add(&format!("{title} published"), &|line| number(line.figures[at].published));
                add(&format!("{title} ratio"), &|line| {
                    Cell::Ratio(ratio(line.figures[at].ours, line.figures[at].published))
                });
            }
            if lines.iter().any(|line| line.figures[at].at_least.is_some()) {
                add(&format!("{title} at least"), &|line| Cell::Ratio(line.figures[at].at_least));
            }
            if metric == RUNTIME {
                add("longest", &|line| {
                    Cell::Number(values(&line.rows, RUNTIME).into_iter().reduce(f64::max))
                });
            }
        }
        if self.shows_decisions {
            for (part, title) in decisions::TITLES.into_iter().enumerate() {
                let times = |line: &Line<'_>| {
                    line.rows.iter().filter_map(|row| decisions::times(row)[part]).collect::<Vec<_>>()
                };
                add(title, &|line| Cell::Number(mean_of(&times(line))));
            }
        }
        let row = |at: usize| columns.iter().map(|(_, cells)| cells[at].clone()).collect();
        let rows = (0..lines.len()).map(row).collect();
        let head = columns.iter().map(|(title, _)| title.clone()).collect();
        Table { head, rows, digits: self.common.digits, remark: Some(remark), ..Table::default() }
    }
}

/// Returns the mean of a metric with its 95 % interval.
fn interval(line: &Line<'_>, metric: &str) -> Option<Estimate> {
    Estimate::of(&values(&line.rows, metric), Spread::Bootstrap { level: 95.0 }, line.num_agents)
}

/// Groups rows by their number of agents.
pub(super) fn by_num_agents<'a>(rows: impl IntoIterator<Item = &'a Row>) -> BTreeMap<u64, Vec<&'a Row>> {
    let mut groups: BTreeMap<u64, Vec<&Row>> = BTreeMap::new();
    for row in rows {
        groups.entry(row.num_agents()).or_default().push(row);
    }
    groups
}

/// Returns the fields that vary in rows.
fn varied<'a>(rows: impl IntoIterator<Item = &'a Row>) -> BTreeSet<&'a String> {
    rows.into_iter().flat_map(|row| row.settings.keys()).collect()
}

/// Checks that every field that varies in the rows of a folder also varies in the published ones.
///
/// # Errors
/// One line with the field. Without this check, several instances would be compared with the same published one.
fn check_columns(view: &str, rows: &[&Row], published: &[Row]) -> Result<(), Error> {
    for name in varied(rows.iter().copied()).difference(&varied(published)) {
        let values = rows.iter().filter_map(|row| row.settings.get(*name)).map(shown);
        let (number, folder) = (values.collect::<BTreeSet<_>>().len(), &rows[0].set);
        if number > 1 {
            return Err(Error::request(format!(
                "view `{view}`: `{name}` has {number} values in `{folder}` and is not varied in the published episodes"
            )));
        }
    }
    Ok(())
}

/// Pairs rows with the published rows of the same instances, identified by the fields that vary in the published rows.
fn pair<'a>(rows: &[&'a Row], published: &'a [Row]) -> Pairing<'a> {
    let columns = varied(published);
    let key = |row: &Row| {
        let fields = columns.iter().map(|&column| shown(row.field(column).unwrap_or(&Value::Null)));
        fields.collect::<Vec<_>>().join(", ")
    };
    Pairing::of(rows.iter().copied(), published, key)
}

/// Compares a metric with the published one; sums of costs only on solved instances.
pub(super) fn figure(
    metric: &str,
    rows: &[&Row],
    pairing: Option<&Pairing<'_>>,
    mean: impl Fn(&str) -> Option<f64>,
) -> Figure {
    match pairing {
        _ if metric != COST => {
            Figure { ours: mean_of(&values(rows, metric)), published: mean(metric), at_least: None }
        }
        Some(pairing) => figure_of_both_solved(pairing),
        None => figure_of_all_solved(rows, mean(COST).filter(|_| mean(SOLVED) == Some(1.0))),
    }
}

/// Compares mean costs on the instances that both algorithms solve.
///
/// The bound counts the instances that the published algorithm solves and for which there is a lower bound.
fn figure_of_both_solved(pairing: &Pairing<'_>) -> Figure {
    let means = |cost: fn(&Row) -> Option<f64>| {
        let solved = pairing.pairs.iter().filter(|(_, published)| published.is_solved());
        let (ours, published): (Vec<f64>, Vec<f64>) =
            solved.filter_map(|(row, published)| Some((cost(row)?, published.metric(COST)?))).unzip();
        (mean_of(&ours), mean_of(&published))
    };
    let ((ours, published), (bound, bounded)) = (means(solved_cost), means(lower_bound));
    Figure { ours, published, at_least: ratio(bound, bounded) }
}

/// Compares the mean cost of solved instances with a published mean over all instances.
fn figure_of_all_solved(rows: &[&Row], published: Option<f64>) -> Figure {
    let costs: Vec<f64> = rows.iter().filter_map(|row| solved_cost(row)).collect();
    let bounds: Vec<f64> = rows.iter().filter_map(|row| lower_bound(row)).collect();
    let is_whole = |figures: &[f64]| figures.len() == rows.len();
    Figure {
        ours: mean_of(&costs),
        published: published.filter(|_| is_whole(&costs)),
        at_least: ratio(mean_of(&bounds).filter(|_| is_whole(&bounds)), published),
    }
}

fn solved_cost(row: &Row) -> Option<f64> {
    row.metric(COST).filter(|_| row.is_solved())
}

fn lower_bound(row: &Row) -> Option<f64> {
    row.proof.lower_bound.map(|bound| bound as f64)
}

/// Returns our figure divided by the published one; `None` if one of them is missing or the published one is 0.
pub(super) fn ratio(ours: Option<f64>, published: Option<f64>) -> Option<f64> {
    Some(ours? / published.filter(|&published| published != 0.0)?)
}
