//! The results of an evaluation: the rows of all algorithms, read from its folder.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use indexmap::{IndexMap, IndexSet};
use pogema_core::Error;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::bounded::read_bounded;
use crate::manifest;
use crate::store::{EPISODES, FAILED, LINES, RESULTS, entries};

/// The column of the algorithm's name.
pub const ALGORITHM: &str = "algorithm";

/// The share of instances that were solved: 1 or 0 in one row.
pub const SOLVED: &str = "CSR";

/// The metric that is compared only on solved instances.
pub(crate) const COST: &str = "SoC";

/// The time of the policy, read from the file of episodes if a row lacks it. Units: seconds.
pub(crate) const RUNTIME: &str = "runtime";

/// The time spent in the policy's network; with several threads, the longest time that one of them spent there. It is
/// read from the file of episodes if a row lacks it. Units: seconds.
pub(crate) const NETWORK_TIME: &str = "network_time";

/// The column of the number of agents.
pub(crate) const NUM_AGENTS: &str = "num_agents";

/// The field of a config that names its map.
const MAP_NAME: &str = "map_name";

/// A JSON object that keeps the order of its names. The columns of tables follow this order.
///
/// If a name occurs twice, the last value counts, as in Python's reader.
pub type Pairs = IndexMap<String, Value>;

/// The largest absolute value that counts as a number.
const LARGEST: f64 = 1e100;

/// What a planner proved about an episode.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Proof {
    /// A lower bound on the sum of costs of any plan. Units: steps, summed over all agents.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower_bound: Option<u64>,
    /// The reason why there is no plan, if that was proved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unsolvable: Option<String>,
}

impl Proof {
    pub(crate) fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// How an episode was played. This may differ between runs even if the results are equal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Episode {
    /// Its index.
    pub episode: usize,
    /// Its environment's seed.
    pub seed: Value,
    /// All fields of its environment.
    pub config: Value,
    /// Time of the policy. Units: seconds.
    pub seconds: Option<f64>,
    /// Time spent in the policy's network, if it has one; with several threads, the longest time that one of them spent
    /// there. Units: seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub network_seconds: Option<f64>,
    /// Index of the run that played it.
    pub run: usize,
    /// The machine, if it differs from that of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub machine: Option<String>,
    /// What the planner proved.
    #[serde(flatten)]
    pub proof: Proof,
}

/// One episode of one algorithm.
///
/// Source: pogema-toolbox 0.1.1, `evaluator.py`, `evaluation`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Metrics by name. Values other than numbers and booleans are kept but not used.
    pub metrics: Pairs,
    /// The varied fields by name.
    #[serde(rename = "env_grid_search")]
    pub settings: Pairs,
    /// The name of the algorithm.
    pub algorithm: String,
    /// The name of its folder.
    #[serde(skip)]
    pub set: String,
    /// Numbers, booleans and the map's name in the environment's config, varied or not, if the folder has them.
    #[serde(skip)]
    pub config: Pairs,
    /// What the planner proved, if the folder has it.
    #[serde(skip)]
    pub proof: Proof,
}

impl Row {
    /// Returns a metric if it is a number of plausible size, or a boolean (1 if true).
    pub fn metric(&self, name: &str) -> Option<f64> {
        figure(self.metrics.get(name)?)
    }

    /// Returns whether the instance was solved. Rows without `CSR`, for example lifelong ones, count as solved.
    pub fn is_solved(&self) -> bool {
        self.metric(SOLVED).is_none_or(|share| share > 0.0)
    }

    /// Returns a field of the environment, varied or not.
    pub fn field(&self, name: &str) -> Option<&Value> {
        self.settings.get(name).or_else(|| self.config.get(name))
    }

    /// Returns the number of agents; POGEMA's default if no field holds it.
    #[cfg(feature = "views")]
    pub(crate) fn num_agents(&self) -> u64 {
        self.field(NUM_AGENTS).and_then(Value::as_u64).unwrap_or(1)
    }

    /// Returns the value in a column that is not a metric.
    pub fn key(&self, column: &str) -> Option<Value> {
        if column == ALGORITHM {
            Some(self.algorithm.clone().into())
        } else {
            self.settings.get(column).cloned()
        }
    }
}

/// Returns a value as a number that can be averaged and drawn.
pub(crate) fn figure(value: &Value) -> Option<f64> {
    let number = value.as_bool().map(|is_so| f64::from(u8::from(is_so))).or(value.as_f64());
    number.filter(|number| number.abs() <= LARGEST)
}

/// Returns whether higher values of a metric are better.
pub fn is_higher_better(metric: &str) -> bool {
    ["CSR", "ISR", "avg_throughput"].contains(&metric)
}

/// Formats a number with at most four decimals and no trailing zeros.
pub fn short(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The rows of one or more folders.
#[derive(Clone, Debug, Default)]
pub struct Results {
    /// The rows: folders in the given order, files of a folder sorted by name, and rows in the order of their file.
    pub rows: Vec<Row>,
    /// Notes on files and rows that were left out, one line each.
    pub notes: Vec<String>,
}

impl Results {
    /// Reads the folders of one or more evaluations, together.
    ///
    /// Each `<algorithm>.json` holds rows. `<algorithm>.episodes.json` holds how the episode of each row was played, in
    /// the order of the rows. The times in this file become the metrics `runtime` and `network_time` of rows that lack
    /// them. `<algorithm>.jsonl` belongs to an unfinished algorithm.
    ///
    /// # Errors
    /// One line with the file and the place in it if a file is invalid; one line if a folder cannot be read or is given
    /// twice, or if there are no rows at all.
    pub fn read(folders: &[PathBuf]) -> Result<Self, Error> {
        let mut results = Self::default();
        for (index, folder) in folders.iter().enumerate() {
            let place = |folder: &PathBuf| folder.canonicalize().ok();
            let twin =
                folders[..index].iter().find(|other| place(other).is_some() && place(other) == place(folder));
            if let Some(twin) = twin {
                let (one, other) = (twin.display(), folder.display());
                return Err(Error::request(format!("`{one}` and `{other}` are the same folder of results")));
            }
        }
        for folder in folders {
            results.read_folder(folder)?;
        }
        if results.rows.is_empty() {
            let names: Vec<String> = folders.iter().map(|folder| format!("`{}`", folder.display())).collect();
            let reason =
                format!("no results in {}, expected <algorithm>.json files with rows", names.join(", "));
            return Err(Error::request(reason));
        }
        Ok(results)
    }

    /// Reads a list of rows of any algorithms, in the format of a file of results. `set` becomes the folder's name in
    /// the rows.
    ///
    /// # Errors
    /// [`Error::Corrupt`] for any other text.
    pub fn parse(text: &str, set: &str) -> Result<Self, Error> {
        let mut rows: Vec<Row> =
            parse_list(text).map_err(|reason| Error::Corrupt { what: "results".into(), reason })?;
        for row in &mut rows {
            set.clone_into(&mut row.set);
        }
        rows.sort_by(|one, other| one.algorithm.cmp(&other.algorithm));
        Ok(Self { rows, notes: Vec::new() })
    }

    fn read_folder(&mut self, folder: &Path) -> Result<(), Error> {
        let set = name_of(folder);
        for path in files_of(folder)? {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if let Some(algorithm) = name.strip_suffix(FAILED) {
                self.notes.push(format!(
                    "{}: some episodes of `{algorithm}` could not be played",
                    folder.display()
                ));
            } else if let Some(algorithm) = name.strip_suffix(LINES) {
                self.notes
                    .push(format!("{}: `{algorithm}` is not finished, so it is left out", folder.display()));
            } else if let Some(algorithm) = name.strip_suffix(RESULTS).filter(|_| !is_apart(&name)) {
                let mut rows = read_rows(&path, algorithm)?;
                join_episodes(&mut rows, &folder.join(format!("{algorithm}{EPISODES}")))?;
                if rows.is_empty() {
                    self.notes.push(format!("{}: no rows", path.display()));
                }
                self.rows.extend(rows.into_iter().map(|row| Row { set: set.clone(), ..row }));
            }
        }
        Ok(())
    }

    /// Returns the names of the algorithms, sorted.
    pub fn algorithms(&self) -> Vec<String> {
        let names: BTreeSet<&String> = self.rows.iter().map(|row| &row.algorithm).collect();
        names.into_iter().cloned().collect()
    }

    /// Returns the rows of each folder, by its name.
    pub fn by_folder(&self) -> BTreeMap<&str, Vec<&Row>> {
        let mut folders: BTreeMap<&str, Vec<&Row>> = BTreeMap::new();
        for row in &self.rows {
            folders.entry(&row.set).or_default().push(row);
        }
        folders
    }

    /// Returns the columns that are not metrics: the varied fields, in order of first appearance, then the algorithm.
    pub fn key_columns(&self) -> Vec<String> {
        let settings = self.rows.iter().flat_map(|row| row.settings.keys());
        let mut columns = first_appearances(settings.filter(|&name| name != ALGORITHM));
        columns.push(ALGORITHM.to_owned());
        columns
    }

    /// Returns the metrics that are a number, a boolean or null in some row, in order of first appearance.
    pub fn metric_columns(&self) -> Vec<String> {
        let is_figure = |value: &Value| value.is_number() || value.is_boolean() || value.is_null();
        let metrics = self.rows.iter().flat_map(|row| row.metrics.iter());
        first_appearances(metrics.filter(|(_, value)| is_figure(value)).map(|(name, _)| name))
    }
}

/// Returns whether a JSON file holds something other than rows.
fn is_apart(name: &str) -> bool {
    name == manifest::FILE || name.ends_with(EPISODES)
}

fn first_appearances<'a>(names: impl Iterator<Item = &'a String>) -> Vec<String> {
    names.collect::<IndexSet<_>>().into_iter().cloned().collect()
}

fn name_of(path: &Path) -> String {
    // `.` and `..` have no file name.
    let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Returns all entries of a folder that are not folders, sorted by name.
fn files_of(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut paths = entries(folder)?;
    paths.retain(|path| !path.is_dir());
    paths.sort();
    Ok(paths)
}

fn read_list<T: DeserializeOwned>(path: &Path, what: &str) -> Result<Vec<T>, Error> {
    let text = String::from_utf8(read_bounded(path)?).map_err(|error| Error::io(path, error))?;
    parse_list(&text).map_err(|reason| Error::io(path, format!("expected a list of {what}: {reason}")))
}

fn parse_list<T: DeserializeOwned>(text: &str) -> Result<Vec<T>, String> {
    serde_json::from_str(&without_nan(text)).map_err(|error| error.to_string())
}

fn read_rows(path: &Path, algorithm: &str) -> Result<Vec<Row>, Error> {
    let rows: Vec<Row> = read_list(path, "results with metrics, env_grid_search and algorithm")?;
    match rows.iter().position(|row| row.algorithm != algorithm) {
        None => Ok(rows),
        Some(index) => {
            let (number, found) = (index + 1, &rows[index].algorithm);
            let reason = format!(
                "row {number} has the algorithm `{found}`, expected `{algorithm}` as in the file name"
            );
            Err(Error::io(path, reason))
        }
    }
}

/// Adds times, config and proof to rows if there is a file of episodes; rows keep the times that they have.
fn join_episodes(rows: &mut [Row], path: &Path) -> Result<(), Error> {
    if !path.exists() {
        return Ok(());
    }
    let episodes: Vec<Episode> = read_list(path, "episodes")?;
    if episodes.len() != rows.len() {
        let reason = format!("`{}` episodes, expected {}, one for each row", episodes.len(), rows.len());
        return Err(Error::io(path, reason));
    }
    for (row, episode) in rows.iter_mut().zip(episodes) {
        if !row.metrics.contains_key(RUNTIME) {
            row.metrics.insert(RUNTIME.to_owned(), episode.seconds.into());
        }
        if let Some(seconds) = episode.network_seconds {
            row.metrics.entry(NETWORK_TIME.to_owned()).or_insert(seconds.into());
        }
        row.config = small_fields(episode.config);
        row.proof = episode.proof;
    }
    Ok(())
}

/// Returns the fields of a config that take little memory. A map's text may be as large as all results together.
fn small_fields(config: Value) -> Pairs {
    let Value::Object(fields) = config else { return Pairs::default() };
    let is_small = |(name, value): &(String, Value)| {
        value.is_number() || value.is_boolean() || name == MAP_NAME && value.is_string()
    };
    fields.into_iter().filter(is_small).collect()
}

/// Replaces `NaN` and infinities with null; Python writes them although JSON does not allow them.
fn without_nan(text: &str) -> String {
    let (mut clean, mut rest, mut in_string) = (String::with_capacity(text.len()), text, false);
    while let Some(next) = rest.chars().next() {
        let word = ["NaN", "-Infinity", "Infinity"].into_iter().find(|word| rest.starts_with(word));
        let taken = match (in_string, next, word) {
            (false, _, Some(word)) => {
                clean.push_str("null");
                rest = &rest[word.len()..];
                continue;
            }
            (true, '\\', _) => 1 + rest.chars().nth(1).map_or(0, char::len_utf8),
            _ => next.len_utf8(),
        };
        in_string ^= next == '"';
        clean.push_str(&rest[..taken]);
        rest = &rest[taken..];
    }
    clean
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROW: &str =
        r#"{"metrics": {"CSR": 1.0, "list": [1]}, "env_grid_search": {"seed": 1}, "algorithm": "A"}"#;

    fn read(files: &[(&str, &str)]) -> Result<Results, String> {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        Results::read(&[folder.path().to_owned()]).map_err(|error| error.to_string())
    }

    #[test]
    fn seconds_become_the_runtime_and_unfinished_algorithms_are_noted() {
        let rows = format!("[{ROW}, {ROW}]");
        let how = |seconds: &str| {
            format!(r#"{{"episode": 0, "seed": 1, "config": {{}}, "seconds": {seconds}, "run": 0}}"#)
        };
        let episodes = format!("[{}, {}]", how("0.5"), how("NaN"));
        let files = [("A.json", rows.as_str()), ("A.episodes.json", &episodes), ("B.jsonl", "unfinished")];
        let results = read(&files).unwrap();
        assert_eq!(results.rows[0].metric("runtime"), Some(0.5));
        assert_eq!(results.rows[1].metric("runtime"), None);
        assert_eq!(results.metric_columns(), ["CSR", "runtime"]);
        assert_eq!(results.key_columns(), ["seed", "algorithm"]);
        assert_eq!(results.notes.len(), 1);
        assert!(results.notes[0].contains("`B` is not finished"), "{:?}", results.notes);
    }

    #[test]
    fn invalid_results_are_rejected_with_their_place() {
        let error_of = |files: &[(&str, &str)]| read(files).unwrap_err();
        let whole = format!("[{ROW}]");
        assert!(error_of(&[("A.json", &whole[..60])]).contains("A.json: expected a list of results"));
        assert!(error_of(&[("A.json", &whole[..60])]).contains("line 1 column 60"));
        assert!(error_of(&[("A.json", "{\"some\": 1}")]).contains("invalid type: map"));
        assert!(error_of(&[("A.json", "[{\"some\": 1}]")]).contains("missing field `metrics` at line 1"));
        assert!(error_of(&[("B.json", &whole)]).contains("row 1 has the algorithm `A`, expected `B`"));
        let episodes = error_of(&[("A.json", &whole), ("A.episodes.json", "[]")]);
        assert!(episodes.contains("`0` episodes, expected 1"), "{episodes}");
        let episodes = error_of(&[("A.json", &whole), ("A.episodes.json", "[1]")]);
        assert!(episodes.contains("expected a list of episodes: invalid type"), "{episodes}");
        assert!(error_of(&[]).contains("no results in"));
        assert!(error_of(&[("A.json", "[]")]).contains("no results in"));
    }

    #[test]
    fn rows_of_a_text_are_read_and_sorted_by_algorithm() {
        let row = |algorithm: &str, soc: &str| {
            format!(r#"{{"metrics": {{"SoC": {soc}}}, "env_grid_search": {{}}, "algorithm": "{algorithm}"}}"#)
        };
        let text = format!("[{}, {}, {}]", row("b/c", "1"), row("about", "NaN"), row("b/c", "2"));
        let results = Results::parse(&text, "set").unwrap();
        let read: Vec<_> = results
            .rows
            .iter()
            .map(|row| (row.algorithm.as_str(), row.metric("SoC"), row.set.as_str()))
            .collect();
        assert_eq!(read, [("about", None, "set"), ("b/c", Some(1.0), "set"), ("b/c", Some(2.0), "set")]);
        let error = Results::parse("[{}]", "set").unwrap_err().to_string();
        assert!(error.contains("results") && error.contains("missing field `metrics`"), "{error}");
    }

    #[test]
    fn pairs_keep_their_order_and_the_last_of_two_values() {
        let text = r#"{"seed":3,"map_name":"wall","a":null,"list":[1,2.5]}"#;
        let pairs: Pairs = serde_json::from_str(text).unwrap();
        assert_eq!(serde_json::to_string(&pairs).unwrap(), text);
        let pairs: Pairs = serde_json::from_str(r#"{"a":1,"b":2,"a":3}"#).unwrap();
        assert_eq!(serde_json::to_string(&pairs).unwrap(), r#"{"a":3,"b":2}"#);
    }

    #[test]
    fn nan_and_infinity_become_null_outside_of_strings() {
        assert_eq!(without_nan(r#"[NaN, "NaN \" NaN", -Infinity]"#), r#"[null, "NaN \" NaN", null]"#);
    }
}
