//! Reads the options of a view.

use pogema_core::{Error, Words};
use pogema_maps::did_you_mean;
use serde_json::Value;

pub(super) use crate::results::NUM_AGENTS;
use crate::suite::{check_keys, missing_field, wrong};
use crate::tree::Node;

/// The options of every view.
///
/// Source: pogema-toolbox 0.1.1, `view_utils.py`, `View`
const COMMON: [&str; 6] =
    ["type", "drop_keys", "round_digits", "rename_fields", "rename_algorithms", "sort_by"];

/// Default titles of columns.
///
/// Source: pogema-toolbox 0.1.1, `view_utils.py`, `View`
const TITLES: [(&str, &str); 6] = [
    ("algorithm", "Algorithm"),
    (NUM_AGENTS, "Number of Agents"),
    ("avg_throughput", "Average Throughput"),
    ("runtime", "Runtime (seconds)"),
    ("network_time", "Network Time (seconds)"),
    ("max_episode_steps", "Episode Length"),
];

/// The fields of one view in its file.
pub(super) struct Options<'a> {
    node: &'a Node,
    view: &'a str,
}

impl<'a> Options<'a> {
    /// Wraps a view's fields if all of them are known.
    pub fn new(view: &'a str, node: &'a Node, known: &[&str]) -> Result<Self, Error> {
        check_keys(node, &format!("view `{view}`"), &COMMON, known)?;
        Ok(Self { node, view })
    }

    /// Returns a field that is present and not null.
    fn field(&self, key: &str) -> Option<&'a Node> {
        self.node.field(key).filter(|node| !node.value().is_null())
    }

    /// Reads a field's value with `read`.
    fn read<T>(
        &self,
        key: &str,
        expected: &str,
        read: impl Fn(&'a Node) -> Option<T>,
    ) -> Result<Option<T>, Error> {
        let Some(node) = self.field(key) else { return Ok(None) };
        read(node).map(Some).ok_or_else(|| self.wrong(node, key, expected))
    }

    /// Returns an error about a field with the expected and the found value.
    fn wrong(&self, node: &Node, key: &str, expected: &str) -> Error {
        wrong(node, &format!("{}.{key}", self.view), expected)
    }

    pub fn text(&self, key: &str) -> Result<Option<String>, Error> {
        self.read(key, "a string", |node| node.text().map(str::to_owned))
    }

    /// Reads a required text.
    pub fn required(&self, key: &str) -> Result<String, Error> {
        self.text(key)?.ok_or_else(|| self.missing(key))
    }

    /// Reads a required text, number or boolean, and returns it formatted for display.
    pub fn required_value(&self, key: &str) -> Result<String, Error> {
        let is_single = |value: &Value| !value.is_object() && !value.is_array();
        let text = self.read(key, "a string, a number or a boolean", |node| {
            Some(node.value()).filter(is_single).map(|value| crate::groups::shown(&value))
        });
        text?.ok_or_else(|| self.missing(key))
    }

    fn missing(&self, key: &str) -> Error {
        missing_field(self.node, self.view, key)
    }

    /// Reads a value that must be one of the given keywords.
    pub fn choice(&self, key: &str, words: &[&'static str]) -> Result<Option<&'static str>, Error> {
        let Some(node) = self.field(key) else { return Ok(None) };
        let given = node.text().unwrap_or_default();
        let found = words.iter().copied().find(|&word| word == given);
        found.map(Some).ok_or_else(|| {
            let hint = did_you_mean(given, words.iter().copied());
            self.wrong(node, key, &format!("one of {}{hint}", words.join(", ")))
        })
    }

    /// Reads a keyword of an enum.
    pub fn word<T: Words>(&self, key: &str) -> Result<Option<T>, Error> {
        Ok(self.choice(key, T::NAMES)?.and_then(T::of_word))
    }

    pub fn flag(&self, key: &str) -> Result<Option<bool>, Error> {
        self.read(key, "True or False", |node| node.value().as_bool())
    }

    /// Reads a number above zero and below ten thousand.
    pub fn size(&self, key: &str) -> Result<Option<f64>, Error> {
        let within = |node: &Node| node.value().as_f64().filter(|&number| number > 0.0 && number < 1e4);
        self.read(key, "a number above 0 and below 10000", within)
    }

    /// Reads a whole number from zero to `most`, inclusive.
    pub fn whole(&self, key: &str, most: u64) -> Result<Option<usize>, Error> {
        let within = |node: &Node| node.value().as_u64().filter(|&number| number <= most);
        Ok(self.read(key, &format!("a whole number from 0 to {most}"), within)?.map(|number| number as usize))
    }

    /// Reads a list of numbers.
    pub fn numbers(&self, key: &str) -> Result<Option<Vec<f64>>, Error> {
        self.read(key, "a list of numbers", |node| {
            node.list()?.iter().map(|node| node.value().as_f64()).collect()
        })
    }

    /// Reads a string or a list of strings.
    pub fn words(&self, key: &str) -> Result<Option<Vec<String>>, Error> {
        self.read(key, "a string or a list of strings", |node| match node.text() {
            Some(text) => Some(vec![text.to_owned()]),
            None => node.list()?.iter().map(|node| node.text().map(str::to_owned)).collect(),
        })
    }

    /// Reads a mapping from names to strings.
    pub fn names(&self, key: &str) -> Result<Option<Vec<(String, String)>>, Error> {
        self.read(key, "a mapping from names to strings", |node| {
            let name = |(key, node): &(String, Node)| Some((key.clone(), node.text()?.to_owned()));
            node.fields()?.iter().map(name).collect()
        })
    }

    /// Reads a list of values of any kind, such as `[ci, 95]`.
    pub fn values(&self, key: &str) -> Result<Option<Vec<Value>>, Error> {
        self.read(key, "a list", |node| Some(node.list()?.iter().map(Node::value).collect()))
    }

    /// Returns an error about a field, or about the view if the field is missing.
    pub fn reject(&self, key: &str, expected: &str) -> Error {
        self.wrong(self.field(key).unwrap_or(self.node), key, expected)
    }
}

/// The options common to all views.
#[derive(Clone, Debug)]
pub(super) struct Common {
    pub drop_keys: Vec<String>,
    pub digits: usize,
    pub sort_by: Vec<String>,
    titles: Vec<(String, String)>,
    algorithms: Vec<(String, String)>,
}

impl Common {
    pub fn read(options: &Options<'_>) -> Result<Self, Error> {
        let owned = |(name, title): (&str, &str)| (name.to_owned(), title.to_owned());
        Ok(Self {
            drop_keys: options.words("drop_keys")?.unwrap_or_else(|| vec!["seed".to_owned()]),
            digits: options.whole("round_digits", 17)?.unwrap_or(2),
            sort_by: options.words("sort_by")?.unwrap_or_default(),
            titles: options.names("rename_fields")?.unwrap_or_else(|| TITLES.map(owned).to_vec()),
            algorithms: options.names("rename_algorithms")?.unwrap_or_default(),
        })
    }

    /// Returns the title of a column.
    pub fn title(&self, column: &str) -> String {
        renamed(&self.titles, column)
    }

    /// Returns the display name of an algorithm.
    pub fn algorithm(&self, name: &str) -> String {
        renamed(&self.algorithms, name)
    }

    /// Formats a value in a column for display.
    pub fn shown(&self, column: &str, value: &Value) -> String {
        let text = crate::groups::shown(value);
        if column == crate::results::ALGORITHM { self.algorithm(&text) } else { text }
    }
}

fn renamed(names: &[(String, String)], name: &str) -> String {
    let found = names.iter().find(|(old, _)| old == name);
    found.map_or(name, |(_, new)| new).to_owned()
}
