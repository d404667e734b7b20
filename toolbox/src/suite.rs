//! Suites: the environments, algorithms and views of an evaluation, read from one YAML file.

use std::path::{Path, PathBuf};

use pogema_core::{Error, Words, shorten, words};
use pogema_maps::{FIELDS, did_you_mean};
use serde_json::Value;

use crate::tree::Node;
use crate::variants::Variants;

/// The keys of a file.
const KEYS: [&str; 5] = ["environment", ALGORITHMS, "results_views", "maps", "dask"];

/// The key of the algorithms.
const ALGORITHMS: &str = "algorithms";

/// The name of POGEMA's environment. Other environments are registered in Python and have their own fields.
pub(crate) const ENVIRONMENT: &str = "Environment";

/// Returns whether the field `name` of an environment names POGEMA's environment.
pub(crate) fn is_pogema(name: Option<&Value>) -> bool {
    name.is_none_or(|name| name.as_str() == Some(ENVIRONMENT))
}

/// The fields of an environment that are not in POGEMA's config.
///
/// Source: pogema-toolbox 0.1.1, `create_env.py`, `Environment`
pub(crate) const TOOLBOX_FIELDS: [&str; 4] = ["name", "with_animation", "use_maps", "scenario"];

words! {
    /// How episodes of an algorithm are distributed to processes. Built-in algorithms use threads instead, unless all
    /// of these hold: the Python package plays them, the backend is one of Dask's, and the address of a scheduler is
    /// given.
    ///
    /// Source: pogema-toolbox 0.1.1, `algorithm_config.py`, `AlgoBase.parallel_backend`
    #[derive(Default)]
    pub enum Backend {
        /// In one process.
        Sequential = "sequential",
        /// In several processes, the longest episodes first.
        Multiprocessing = "multiprocessing",
        /// The same as `multiprocessing`.
        #[default]
        BalancedMultiprocessing = "balanced_multiprocessing",
        /// On a Dask cluster, the longest episodes first.
        Dask = "dask",
        /// The same as `dask`.
        BalancedDask = "balanced_dask",
    }
}

/// The keys common to all algorithms; all others are the algorithm's own parameters.
const ALGORITHM_KEYS: [&str; 3] = ["name", "num_process", "parallel_backend"];

/// The description of an evaluation, as in its file.
#[derive(Clone, Debug)]
pub struct Suite {
    /// Path of its file.
    pub path: PathBuf,
    /// Text of its file.
    pub text: String,
    /// The file whose algorithms replace its own.
    pub replacement: Option<Replacement>,
    /// One environment per episode.
    pub environments: Variants,
    /// The algorithms, each of which plays all episodes.
    pub algorithms: Vec<Algorithm>,
    /// The views of the results, by name.
    pub views: Vec<(String, Node)>,
    /// Files and folders with maps.
    pub maps: Vec<PathBuf>,
    /// The address of a Dask scheduler.
    pub dask: Option<String>,
}

/// A file whose algorithms replace those of a suite.
#[derive(Clone, Debug)]
pub struct Replacement {
    /// Its path.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
}

/// An algorithm of a suite.
#[derive(Clone, Debug)]
pub struct Algorithm {
    /// The name of its results.
    pub key: String,
    /// The line of the file where it begins.
    pub line: u64,
    /// The name under which it is registered.
    pub name: String,
    /// Maximum number of processes or threads for its episodes, if given.
    pub num_processes: Option<usize>,
    /// How its episodes are distributed.
    pub backend: Backend,
    /// Its own parameters, in the order of the file.
    pub parameters: Vec<(String, Node)>,
}

impl Suite {
    /// Reads a suite from a file.
    ///
    /// # Errors
    /// One line with the file, the line, the invalid key and what is expected there.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::parse(path, &pogema_maps::files::read_text(path)?)
    }

    /// Reads a suite from the text of a file.
    ///
    /// # Errors
    /// Those of [`Suite::read`].
    pub fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        Node::parse(text).and_then(|root| Self::of(path, text, &root)).map_err(|error| in_file(path, error))
    }

    /// Replaces the algorithms of the suite with those of a file whose only key is `algorithms`.
    ///
    /// # Errors
    /// Those of [`Suite::read`].
    pub fn with_algorithms(mut self, path: &Path) -> Result<Self, Error> {
        let text = pogema_maps::files::read_text(path)?;
        let read = |root: Node| {
            check_keys(&root, "the file", &[ALGORITHMS], &[])?;
            algorithms(&root)
        };
        self.algorithms = Node::parse(&text).and_then(read).map_err(|error| in_file(path, error))?;
        self.replacement = Some(Replacement { path: path.to_owned(), text });
        Ok(self)
    }

    /// Returns the algorithm whose results have the name `key`.
    pub fn algorithm(&self, key: &str) -> Option<&Algorithm> {
        self.algorithms.iter().find(|algorithm| algorithm.key == key)
    }

    /// Returns whether the suite has environments other than POGEMA's.
    pub fn is_foreign(&self) -> bool {
        self.environments.values_of("name").into_iter().any(|name| !is_pogema(Some(name)))
    }

    /// Returns the folder of the suite's file. Paths in the suite, and in a file that replaces its algorithms, are
    /// relative to this folder.
    pub fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Adds the path of the suite to an error.
    pub fn in_file(&self, error: Error) -> Error {
        in_file(&self.path, error)
    }

    /// Adds the path of the file with the algorithms to an error.
    pub fn in_algorithms_file(&self, error: Error) -> Error {
        in_file(self.replacement.as_ref().map_or(&self.path, |file| &file.path), error)
    }

    fn of(path: &Path, text: &str, root: &Node) -> Result<Self, Error> {
        check_keys(root, "the file", &KEYS, &[])?;
        let environment = required(root, "environment")?;
        let environments = Variants::of(environment)?;
        if environments.values_of("name").into_iter().all(|name| is_pogema(Some(name))) {
            check_keys(environment, "environment", &FIELDS, &TOOLBOX_FIELDS)?;
        }
        if environments.is_empty() {
            return Err(wrong_key(environment, "environment", "at least one value of each varied field"));
        }
        let algorithms = algorithms(root)?;
        let views = root.field("results_views").map(|node| fields(node, "results_views")).transpose()?;
        let dask = root.field("dask").map(|node| text_of(node, "dask", "an address such as tcp://host:8786"));
        Ok(Self {
            path: path.to_owned(),
            text: text.to_owned(),
            replacement: None,
            environments,
            algorithms,
            views: views.unwrap_or_default().to_vec(),
            maps: maps(path, root)?,
            dask: dask.transpose()?.map(str::to_owned),
        })
    }
}

fn algorithms(root: &Node) -> Result<Vec<Algorithm>, Error> {
    let entries = fields(required(root, ALGORITHMS)?, ALGORITHMS)?;
    for (index, (key, node)) in entries.iter().enumerate() {
        let twin = entries[..index].iter().find(|(other, _)| other.to_lowercase() == key.to_lowercase());
        if let Some((other, _)) = twin {
            let expected =
                format!("a name that differs from `{other}` in more than case: file systems may ignore case");
            return Err(wrong_key(node, key, &expected));
        }
    }
    entries.iter().map(|(key, node)| Algorithm::read(key, node)).collect()
}

/// Returns the paths of the files and folders with maps, resolved against the suite's folder.
fn maps(path: &Path, root: &Node) -> Result<Vec<PathBuf>, Error> {
    let Some(node) = root.field("maps") else { return Ok(Vec::new()) };
    let folder = path.parent().unwrap_or(Path::new(""));
    let nodes = node.list().unwrap_or(std::slice::from_ref(node)).iter();
    nodes.map(|node| Ok(folder.join(text_of(node, "maps", "a file or folder, or a list of them")?))).collect()
}

impl Algorithm {
    fn read(key: &str, node: &Node) -> Result<Self, Error> {
        if !is_file_name(key) {
            return Err(wrong_key(node, key, "a name that is valid for a file of results"));
        }
        let own = |field: &str| format!("{key}.{field}");
        let all = fields(node, key)?;
        let name = node.field("name").ok_or_else(|| missing_field(node, key, "name"))?;
        let name = text_of(name, &own("name"), "the name of an algorithm")?;
        let backend = node.field("parallel_backend");
        let backend = backend.map(|node| {
            let expected = || format!("one of {}", Backend::NAMES.join(", "));
            let word = node.text().and_then(Backend::of_word);
            word.ok_or_else(|| wrong(node, &own("parallel_backend"), &expected()))
        });
        let num_processes = node.field("num_process").map(|node| {
            let number = node.value().as_u64().filter(|&number| number > 0);
            number.ok_or_else(|| wrong(node, &own("num_process"), "a whole number of 1 or more"))
        });
        let is_own = |(key, _): &&(String, Node)| !ALGORITHM_KEYS.contains(&key.as_str());
        Ok(Self {
            key: key.to_owned(),
            line: node.line,
            name: name.to_owned(),
            num_processes: num_processes.transpose()?.map(|number| number as usize),
            backend: backend.transpose()?.unwrap_or_default(),
            parameters: all.iter().filter(is_own).cloned().collect(),
        })
    }

    /// Returns a text that differs between algorithms with different names or parameters.
    pub fn fingerprint(&self) -> String {
        let parameters = self.parameters.iter().map(|(key, node)| serde_json::json!([key, node.value()]));
        serde_json::json!([self.name, parameters.collect::<Vec<_>>()]).to_string()
    }
}

/// Returns whether the files of an algorithm can have this name.
fn is_file_name(key: &str) -> bool {
    let is_plain = |letter: char| !letter.is_control() && !"/\\".contains(letter);
    let is_plain_on_windows = |letter: char| !"<>:\"|?*".contains(letter);
    // These names belong to other files in the folder of results. Some file systems ignore case.
    let lower = key.to_lowercase();
    let is_taken = lower == "about" || lower.ends_with(".episodes") || lower.ends_with(".failed");
    !key.is_empty()
        && !key.starts_with('.')
        && !is_taken
        && key.chars().all(is_plain)
        && (!cfg!(windows) || key.chars().all(is_plain_on_windows))
}

/// Adds the path of a file to an error.
pub(crate) fn in_file(path: &Path, error: Error) -> Error {
    match error {
        Error::Syntax { reason } | Error::Request { reason } => Error::io(path, reason),
        error => Error::io(path, error),
    }
}

fn fields<'a>(node: &'a Node, key: &str) -> Result<&'a [(String, Node)], Error> {
    node.fields().ok_or_else(|| wrong(node, key, "names and their fields"))
}

fn text_of<'a>(node: &'a Node, key: &str, expected: &str) -> Result<&'a str, Error> {
    node.text().ok_or_else(|| wrong(node, key, expected))
}

fn required<'a>(root: &'a Node, key: &str) -> Result<&'a Node, Error> {
    root.field(key).ok_or_else(|| Error::Syntax {
        reason: format!("line {}: the file lacks the field `{key}`", root.line),
    })
}

/// Returns an error about the value of a key, with its line and the expected value.
pub(crate) fn wrong(node: &Node, key: &str, expected: &str) -> Error {
    if node.fields().is_some() {
        return wrong_key(node, key, expected);
    }
    let found = node.text().map_or_else(|| node.value().to_string(), str::to_owned);
    let found = shorten(&found, Error::LONGEST_QUOTE);
    Error::Syntax { reason: format!("line {}: `{key}` is `{found}`, expected {expected}", node.line) }
}

/// Returns an error about a field that is missing below a key, with the line of the key.
pub(crate) fn missing_field(node: &Node, key: &str, field: &str) -> Error {
    Error::Syntax { reason: format!("line {}: `{key}` lacks the field `{field}`", node.line) }
}

/// Returns an error about a key, with its line.
pub(crate) fn wrong_key(node: &Node, key: &str, expected: &str) -> Error {
    Error::Syntax { reason: format!("line {}: `{key}`, expected {expected}", node.line) }
}

/// Checks that all keys are known.
pub(crate) fn check_keys(node: &Node, what: &str, known: &[&str], more: &[&str]) -> Result<(), Error> {
    let fields = node.fields().ok_or_else(|| Error::Syntax {
        reason: format!("line {}: {what} has no fields, expected keys and values", node.line),
    })?;
    let all = || known.iter().chain(more).copied();
    match fields.iter().find(|(key, _)| !all().any(|known| known == key)) {
        None => Ok(()),
        Some((key, value)) => {
            let hint = did_you_mean(key, all());
            let reason = format!("line {}: unknown key `{key}` in {what}{hint}", value.line);
            Err(Error::Syntax { reason })
        }
    }
}
