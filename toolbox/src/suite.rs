//! What an evaluation is to do: environments, algorithms and views, read from one YAML file.

use std::path::{Path, PathBuf};

use pogema_core::Error;
use pogema_maps::{FIELDS, nearest};
use serde_json::{Map as Object, Value};

use crate::tree::Node;
use crate::variants::Variants;

/// The keys of a file.
const KEYS: [&str; 4] = ["environment", "algorithms", "results_views", "dask"];

/// The fields of an environment that are not POGEMA's.
///
/// Source: pogema-toolbox 0.1.1, `create_env.py`, `Environment`
const OWN_FIELDS: [&str; 4] = ["name", "with_animation", "use_maps", "scenario"];

/// How episodes of an algorithm are shared among processes; built-in algorithms use threads instead.
///
/// Source: pogema-toolbox 0.1.1, `algorithm_config.py`, `AlgoBase.parallel_backend`
pub const BACKENDS: [&str; 5] =
    ["sequential", "multiprocessing", "balanced_multiprocessing", "dask", "balanced_dask"];

/// The keys of every algorithm; all others are parameters of its own.
const ALGORITHM_KEYS: [&str; 4] = ["name", "num_process", "parallel_backend", "seed"];

/// An evaluation as its file says it.
#[derive(Clone, Debug)]
pub struct Suite {
    /// Where it was read.
    pub path: PathBuf,
    /// One environment for each episode.
    pub environments: Variants,
    /// Who plays, each all episodes.
    pub algorithms: Vec<Algorithm>,
    /// What to show of the results, by name.
    pub views: Vec<(String, Node)>,
    /// The address of a Dask scheduler.
    pub dask: Option<String>,
}

/// Who plays, under the name that results have.
#[derive(Clone, Debug)]
pub struct Algorithm {
    /// The name of its results.
    pub key: String,
    /// The line of the file on which it begins.
    pub line: u64,
    /// The name under which it is registered.
    pub name: String,
    /// Most processes or threads that play its episodes.
    pub num_processes: usize,
    /// One of [`BACKENDS`].
    pub backend: String,
    /// All its fields as they stand there.
    pub fields: Object<String, Value>,
}

impl Suite {
    /// Reads a file.
    ///
    /// # Errors
    /// One line with the file, the line and the key of what is wrong, and of what was expected there.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, error))?;
        Self::parse(path, &text)
    }

    /// Reads the text of a file.
    ///
    /// # Errors
    /// As for [`Suite::read`].
    pub fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        let in_file = |error: Error| match error {
            Error::Syntax { reason } | Error::State { reason } => Error::io(path, reason),
            error => Error::io(path, error),
        };
        Self::from_node(path, &Node::parse(text).map_err(in_file)?).map_err(in_file)
    }

    fn from_node(path: &Path, root: &Node) -> Result<Self, Error> {
        check_keys(root, "the file", &KEYS, &[])?;
        let environment = required(root, "environment")?;
        check_keys(environment, "environment", &FIELDS, &OWN_FIELDS)?;
        let entries = required(root, "algorithms")?;
        let algorithms =
            entries.fields().ok_or_else(|| wrong(entries, "algorithms", "names and their fields"))?;
        let algorithms = algorithms.iter().map(|(key, node)| Algorithm::read(key, node));
        let views = match root.field("results_views") {
            Some(node) => {
                node.fields().ok_or_else(|| wrong(node, "results_views", "names and their fields"))?
            }
            None => &[],
        };
        let dask = root.field("dask").map(|node| {
            node.text()
                .map(str::to_owned)
                .ok_or_else(|| wrong(node, "dask", "an address such as tcp://host:8786"))
        });
        Ok(Self {
            path: path.to_owned(),
            environments: Variants::of(environment)?,
            algorithms: algorithms.collect::<Result<_, _>>()?,
            views: views.to_vec(),
            dask: dask.transpose()?,
        })
    }
}

impl Algorithm {
    fn read(key: &str, node: &Node) -> Result<Self, Error> {
        let fields = node.fields().ok_or_else(|| wrong(node, key, "fields such as `name: lacam`"))?;
        let text = |field: &str, expected: &str| match node.field(field) {
            Some(node) => {
                node.text().map(Some).ok_or_else(|| wrong(node, &format!("{key}.{field}"), expected))
            }
            None => Ok(None),
        };
        let name = text("name", "the name of an algorithm")?;
        let name = name.ok_or_else(|| wrong(node, key, "a field `name`"))?;
        let backend = text("parallel_backend", "a backend")?.unwrap_or("balanced_multiprocessing");
        if !BACKENDS.contains(&backend) {
            let at = node.field("parallel_backend").unwrap_or(node);
            return Err(wrong(
                at,
                &format!("{key}.parallel_backend"),
                &format!("one of {}", BACKENDS.join(", ")),
            ));
        }
        let num_processes = match node.field("num_process") {
            Some(at) => at
                .value()
                .as_u64()
                .filter(|&number| number > 0)
                .ok_or_else(|| wrong(at, &format!("{key}.num_process"), "a number of 1 or more"))?,
            None => 3,
        };
        Ok(Self {
            key: key.to_owned(),
            line: node.line,
            name: name.to_owned(),
            num_processes: num_processes as usize,
            backend: backend.to_owned(),
            fields: fields.iter().map(|(key, node)| (key.clone(), node.value())).collect(),
        })
    }

    /// The fields that are its own, not those of every algorithm.
    pub fn parameters(&self) -> impl Iterator<Item = (&String, &Value)> {
        self.fields.iter().filter(|(key, _)| !ALGORITHM_KEYS.contains(&key.as_str()))
    }
}

fn required<'a>(root: &'a Node, key: &str) -> Result<&'a Node, Error> {
    root.field(key).ok_or_else(|| wrong(root, "the file", &format!("a field `{key}`")))
}

/// An error about a value that should be something else.
pub(crate) fn wrong(node: &Node, key: &str, expected: &str) -> Error {
    Error::Syntax { reason: format!("line {}: `{key}`, expected {expected}", node.line) }
}

/// Passes if all keys are known.
pub(crate) fn check_keys(node: &Node, what: &str, known: &[&str], more: &[&str]) -> Result<(), Error> {
    let fields = node.fields().ok_or_else(|| wrong(node, what, "keys and values"))?;
    let all = || known.iter().chain(more).copied();
    match fields.iter().find(|(key, _)| !all().any(|known| known == key)) {
        None => Ok(()),
        Some((key, value)) => {
            let hint = nearest(key, all()).unwrap_or_default();
            let reason = format!(
                "line {}: unknown key `{key}` in {what}; the nearest known one is `{hint}`",
                value.line
            );
            Err(Error::Syntax { reason })
        }
    }
}
