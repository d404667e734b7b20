//! Published means, read from a CSV file.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use pogema_core::Error;
use pogema_maps::did_you_mean;
use pogema_maps::files::read_text;

use crate::results::{COST, NUM_AGENTS, SOLVED};

/// The columns that identify a row.
const KEYS: [&str; 4] = ["setting", "dataset", "algorithm", NUM_AGENTS];

/// The value of `num_agents` in rows with a mean over all numbers of agents. No view shows these rows.
const ALL: &str = "all";

/// The content of a file of means, with a row for each setting, dataset, algorithm and number of agents.
pub(super) struct Means {
    path: PathBuf,
    /// For each row, the text of each cell by the name of its column.
    rows: Vec<HashMap<String, String>>,
}

impl Means {
    /// Reads a file that has a column for each metric, with numbers or empty cells. For the sum of costs, it also needs
    /// the share of solved instances, because sums of costs are compared only if all instances are solved.
    ///
    /// # Errors
    /// One line with the file and either the missing column or the line of the error; for a wrong number, also its
    /// column. A row that repeats the keys of an earlier one is an error, too.
    pub fn read(path: &Path, metrics: &[String]) -> Result<Self, Error> {
        let text = read_text(path)?;
        let failed = |error: csv::Error| Error::io(path, error);
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let head = reader.headers().map_err(failed)?.clone();
        let solved = metrics.iter().any(|metric| metric == COST).then_some(SOLVED);
        let metrics = || metrics.iter().map(String::as_str).chain(solved);
        if let Some(name) =
            KEYS.into_iter().chain(metrics()).find(|name| !head.iter().any(|one| one == *name))
        {
            return Err(Error::io(path, format!("no column `{name}`{}", did_you_mean(name, &head))));
        }
        let mut rows: Vec<HashMap<String, String>> = Vec::new();
        let mut lines = HashMap::new();
        for record in reader.records() {
            let record = record.map_err(failed)?;
            let row: HashMap<String, String> = record.deserialize(Some(&head)).map_err(failed)?;
            let line = record.position().map_or(0, csv::Position::line);
            let wrong = |name: &str, expected: &str| {
                let found = &row[name];
                Error::io(path, format!("line {line}: `{name}` is `{found}`, expected {expected}"))
            };
            if let Some(name) = metrics().find(|&name| !row[name].is_empty() && number(&row[name]).is_none())
            {
                return Err(wrong(name, "a number or an empty cell"));
            }
            if row[NUM_AGENTS].parse::<u64>().is_err() && row[NUM_AGENTS] != ALL {
                return Err(wrong(NUM_AGENTS, "a whole number or `all`"));
            }
            if let Some(first) = lines.insert(KEYS.map(|name| row[name].clone()), line) {
                let reason = format!("line {line}: the row repeats the {} of line {first}", KEYS.join(", "));
                return Err(Error::io(path, reason));
            }
            rows.push(row);
        }
        Ok(Self { path: path.to_owned(), rows })
    }

    /// Returns the mean of a metric, if the file has it.
    pub fn mean(
        &self,
        [setting, dataset, algorithm]: [&str; 3],
        num_agents: u64,
        metric: &str,
    ) -> Option<f64> {
        let keys = [setting, dataset, algorithm, &num_agents.to_string()];
        let matches = |row: &&HashMap<_, _>| KEYS.iter().zip(keys).all(|(column, key)| row[*column] == key);
        number(self.rows.iter().find(matches)?.get(metric)?)
    }

    /// Checks that there are rows of a setting, a dataset and an algorithm.
    ///
    /// # Errors
    /// One line with the first of the three that is unknown, and the nearest known value.
    pub fn check(&self, view: &str, keys: [&str; 3]) -> Result<(), Error> {
        let mut rows: Vec<_> = self.rows.iter().collect();
        for (place, (column, key)) in KEYS.into_iter().zip(keys).enumerate() {
            let known: Vec<&str> = rows.iter().map(|row| row[column].as_str()).collect();
            if !known.contains(&key) {
                let (hint, path) = (did_you_mean(key, known), self.path.display());
                let of = if place == 0 { String::new() } else { format!(" of {}", keys[..place].join(", ")) };
                let reason = format!("view `{view}`: `{path}` has no {column} `{key}`{of}{hint}");
                return Err(Error::request(reason));
            }
            rows.retain(|row| row[column] == key);
        }
        Ok(())
    }
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.is_finite())
}
