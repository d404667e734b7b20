//! Published means, read from a file with commas.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use csv::StringRecord;
use pogema_core::Error;
use pogema_maps::files::read_text;
use pogema_maps::nearest;

/// The columns that say what a row is about.
const KEYS: [&str; 4] = ["setting", "dataset", "algorithm", "num_agents"];

/// A file of means, with a row for each setting, dataset, algorithm and number of agents.
#[derive(Clone, Debug)]
pub(super) struct Means {
    path: PathBuf,
    rows: Vec<Mean>,
}

/// One row.
#[derive(Clone, Debug)]
struct Mean {
    /// In the order of [`KEYS`].
    keys: [String; 4],
    figures: BTreeMap<String, f64>,
}

impl Means {
    /// Reads a file that has a column for each metric.
    ///
    /// # Errors
    /// One line with the file, the line and the column of what is wrong.
    pub fn read(path: &Path, metrics: &[String]) -> Result<Self, Error> {
        let text = read_text(path)?;
        let wrong = |reason: String| Error::io(path, reason);
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let head = reader.headers().map_err(|error| Error::io(path, error))?.clone();
        let column = |name: &str| {
            head.iter().position(|known| known == name).ok_or_else(|| {
                let hint = nearest(name, head.iter()).unwrap_or_default();
                wrong(format!("no column `{name}`; the nearest one is `{hint}`"))
            })
        };
        let [setting, dataset, algorithm, num_agents] = KEYS;
        let places = [column(setting)?, column(dataset)?, column(algorithm)?, column(num_agents)?];
        metrics.iter().try_for_each(|metric| column(metric).map(|_| ()))?;
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| Error::io(path, error))?;
            let keys = places.map(|place| record[place].to_owned());
            let figures = figures(&head, &record, metrics).map_err(wrong)?;
            rows.push(Mean { keys, figures });
        }
        Ok(Self { path: path.to_owned(), rows })
    }

    /// Returns the mean of a metric, if the file has it.
    pub fn mean(&self, keys: [&str; 3], num_agents: u64, metric: &str) -> Option<f64> {
        let [setting, dataset, algorithm] = keys;
        let wanted = [setting, dataset, algorithm, &num_agents.to_string()];
        let found = self.rows.iter().find(|row| row.keys.each_ref().map(String::as_str) == wanted);
        found?.figures.get(metric).copied()
    }

    /// Passes if there are rows of a setting, a dataset and an algorithm.
    ///
    /// # Errors
    /// Names the first of the three that is unknown, and the nearest known value.
    pub fn check(&self, view: &str, keys: [&str; 3]) -> Result<(), Error> {
        let mut rows: Vec<&Mean> = self.rows.iter().collect();
        for (place, key) in keys.into_iter().enumerate() {
            let known: Vec<&Mean> = rows.iter().copied().filter(|row| row.keys[place] == key).collect();
            if known.is_empty() {
                let hint = nearest(key, rows.iter().map(|row| row.keys[place].as_str()));
                let hint = hint.map(|hint| format!("; the nearest one is `{hint}`")).unwrap_or_default();
                let (column, path) = (KEYS[place], self.path.display());
                let of = if place == 0 { String::new() } else { format!(" of {}", keys[..place].join(", ")) };
                let reason = format!("view `{view}`: `{path}` has no {column} `{key}`{of}{hint}");
                return Err(Error::Request { reason });
            }
            rows = known;
        }
        Ok(())
    }
}

/// The numbers of a row; what is empty is left out, and so is other text in columns that are no metrics.
fn figures(
    head: &StringRecord,
    record: &StringRecord,
    metrics: &[String],
) -> Result<BTreeMap<String, f64>, String> {
    let mut figures = BTreeMap::new();
    for (name, text) in head.iter().zip(record).filter(|(_, text)| !text.is_empty()) {
        match text.parse::<f64>().ok().filter(|number| number.is_finite()) {
            Some(number) => _ = figures.insert(name.to_owned(), number),
            None if metrics.iter().any(|metric| metric == name) => {
                let line = record.position().map_or(0, csv::Position::line);
                return Err(format!("line {line}: `{name}` is `{text}`, expected a number or nothing"));
            }
            None => {}
        }
    }
    Ok(figures)
}
