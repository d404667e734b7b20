//! Combinations of varied fields, one environment each.

use pogema_core::{Error, shorten};
use serde_json::{Map as Object, Value};

use crate::results::Pairs;
use crate::tree::{Content, Node};

/// The largest number of combinations. A run holds a few dozen bytes for each of them.
const MOST: usize = 10_000_000;

/// The key of the list of values over which a field is varied.
const GRID: &str = "grid_search";

/// A varied field and its values.
#[derive(Clone, Debug)]
struct Parameter {
    path: Vec<String>,
    /// Each value with its line in the file.
    values: Vec<(Value, u64)>,
}

/// The combinations of all varied fields, each created on request. The last field changes fastest.
///
/// Source: pogema-toolbox 0.1.1, `config_variant_generator.py`, `generate_variants`
#[derive(Clone, Debug)]
pub struct Variants {
    fields: Value,
    parameters: Vec<Parameter>,
    line: u64,
    /// The line of each top-level field that is not varied.
    lines: Vec<(String, u64)>,
}

/// One combination.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// The varied fields by the last key of their path, in the order of the file.
    pub changes: Pairs,
    /// All fields.
    pub fields: Object<String, Value>,
}

impl Variants {
    /// Finds the varied fields at any depth, except within lists.
    ///
    /// # Errors
    /// One line if `grid_search` is not below a field, if its value is not a list, if there are other keys beside it,
    /// if there are more than ten million combinations, or if two varied fields have the same last key. Results could
    /// not distinguish such fields.
    pub fn of(node: &Node) -> Result<Self, Error> {
        let mut parameters: Vec<Parameter> = Vec::new();
        let fields = plain(node, &mut Vec::new(), &mut parameters)?;
        for (index, parameter) in parameters.iter().enumerate() {
            let twin = parameters[..index].iter().find(|other| other.path.last() == parameter.path.last());
            if let Some(twin) = twin {
                let (one, other) = (twin.path.join("."), parameter.path.join("."));
                let line = parameter.values.first().map_or(node.line, |(_, line)| *line);
                let reason = format!(
                    "line {line}: `{one}` and `{other}` are both varied, expected different last keys"
                );
                return Err(Error::Syntax { reason });
            }
        }
        let lengths = || parameters.iter().map(|parameter| parameter.values.len());
        let product = lengths().try_fold(1, usize::checked_mul).filter(|&product| product <= MOST);
        if product.is_none() && lengths().all(|length| length > 0) {
            let lengths: Vec<String> = lengths().map(|length| length.to_string()).collect();
            let found = lengths.join(" x ");
            let reason = format!("line {}: {found} combinations, expected at most {MOST}", node.line);
            return Err(Error::Syntax { reason });
        }
        let all = node.fields().unwrap_or_default().iter();
        let plain = all.filter(|(_, node)| node.field(GRID).is_none());
        let lines = plain.map(|(key, node)| (key.clone(), node.line)).collect();
        Ok(Self { fields, parameters, line: node.line, lines })
    }

    /// Returns the number of combinations; 1 if nothing is varied.
    pub fn len(&self) -> usize {
        self.parameters.iter().map(|parameter| parameter.values.len()).product()
    }

    /// Returns whether a field is varied over an empty list.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns indices of combinations that cover each value of each varied field, with the line of that value.
    ///
    /// In each of these combinations, the other varied fields have their first value.
    pub fn probes(&self) -> impl Iterator<Item = (usize, u64)> {
        let mut stride = self.len();
        let values = self.parameters.iter().flat_map(move |Parameter { values, .. }| {
            stride /= values.len().max(1);
            let first_stride = stride;
            values.iter().enumerate().map(move |(at, (_, line))| (at * first_stride, *line))
        });
        let (is_plain, is_empty) = (self.parameters.is_empty(), self.is_empty());
        is_plain.then_some((0, self.line)).into_iter().chain(values).filter(move |_| !is_empty)
    }

    /// Returns the line of a top-level field that is not varied.
    pub fn line_of(&self, field: &str) -> Option<u64> {
        self.lines.iter().find(|(key, _)| key == field).map(|(_, line)| *line)
    }

    /// Returns all values of a top-level field, varied or not.
    pub fn values_of(&self, field: &str) -> Vec<&Value> {
        match self.parameter(field) {
            Some(parameter) => parameter.values.iter().map(|(value, _)| value).collect(),
            None => self.fields.get(field).into_iter().collect(),
        }
    }

    /// Returns the value of a top-level field in a combination.
    pub fn value_at(&self, index: usize, field: &str) -> Option<&Value> {
        let Some(parameter) = self.parameter(field) else { return self.fields.get(field) };
        let faster = self.parameters.iter().skip_while(|other| !std::ptr::eq(*other, parameter)).skip(1);
        let stride: usize = faster.map(|other| other.values.len()).product();
        let values = &parameter.values;
        values.get(index / stride.max(1) % values.len().max(1)).map(|(value, _)| value)
    }

    fn parameter(&self, field: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|parameter| parameter.path == [field])
    }

    /// Returns a text that differs between different sets of combinations.
    pub fn fingerprint(&self) -> String {
        let parameters: Vec<_> = self
            .parameters
            .iter()
            .map(|Parameter { path, values }| {
                let values: Vec<&Value> = values.iter().map(|(value, _)| value).collect();
                serde_json::json!([path, values])
            })
            .collect();
        serde_json::json!([self.fields, parameters]).to_string()
    }

    /// Returns the combination at an index; `None` if the index is out of range.
    pub fn at(&self, index: usize) -> Option<Variant> {
        if index >= self.len() {
            return None;
        }
        let (mut rest, mut fields, mut changes) = (index, self.fields.clone(), Pairs::new());
        for Parameter { path, values } in self.parameters.iter().rev() {
            let (value, _) = &values[rest % values.len()];
            rest /= values.len();
            let place = path.iter().try_fold(&mut fields, |place, key| place.get_mut(key))?;
            place.clone_from(value);
            changes.insert(path.last()?.clone(), value.clone());
        }
        changes.reverse();
        match fields {
            Value::Object(fields) => Some(Variant { changes, fields }),
            _ => None,
        }
    }
}

/// Returns the value of a node, with null in place of each varied field. Adds these fields to `found`.
fn plain(node: &Node, path: &mut Vec<String>, found: &mut Vec<Parameter>) -> Result<Value, Error> {
    let Content::Fields(fields) = &node.content else { return Ok(node.value()) };
    if let Some(values) = node.field(GRID) {
        let wrong = |what: &str| {
            let key = path.join(".");
            Error::Syntax { reason: format!("line {}: `{key}`: {what}", node.line) }
        };
        if path.is_empty() {
            let reason = format!("line {}: `{GRID}` belongs below a field", node.line);
            return Err(Error::Syntax { reason });
        }
        if let Some((other, _)) = fields.iter().find(|(key, _)| key != GRID) {
            return Err(wrong(&format!("unknown key `{other}` beside `{GRID}`")));
        }
        let values = values.list().ok_or_else(|| {
            let shown = shorten(&values.value().to_string(), Error::LONGEST_QUOTE);
            wrong(&format!("`{GRID}` is `{shown}`, expected a list"))
        })?;
        found.push(Parameter {
            path: path.clone(),
            values: values.iter().map(|node| (node.value(), node.line)).collect(),
        });
        return Ok(Value::Null);
    }
    let mut object = Object::new();
    for (key, value) in fields {
        path.push(key.clone());
        object.insert(key.clone(), plain(value, path, found)?);
        path.pop();
    }
    Ok(Value::Object(object))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variants(text: &str) -> Result<Variants, Error> {
        Variants::of(&Node::parse(text)?)
    }

    #[test]
    fn the_last_field_changes_fastest() {
        let text = "size: 8\nseed:\n  grid_search: [1, 2]\ndeep:\n  agents:\n    grid_search: [a, b, c]\n";
        let variants = variants(text).unwrap();
        let label = |index: usize| {
            let variant = variants.at(index).unwrap();
            assert_eq!(variant.fields["size"], 8);
            assert_eq!(variant.fields["seed"], variant.changes[0]);
            assert_eq!(variant.fields["deep"]["agents"], variant.changes[1]);
            assert!(variant.changes.keys().eq(["seed", "agents"]));
            format!("{}{}", variant.changes[0], variant.changes[1].as_str().unwrap())
        };
        assert_eq!(variants.len(), 6);
        assert_eq!((0..6).map(label).collect::<Vec<_>>(), ["1a", "1b", "1c", "2a", "2b", "2c"]);
        assert!(variants.at(6).is_none());
    }

    #[test]
    fn no_varied_field_gives_one_combination_and_an_empty_list_gives_none() {
        assert_eq!(variants("size: 8").unwrap().len(), 1);
        assert!(variants("size: 8").unwrap().at(0).unwrap().changes.is_empty());
        assert!(variants("seed: {grid_search: []}").unwrap().is_empty());
        // Fields within a list are not varied.
        assert_eq!(variants("maps: [{grid_search: [1, 2]}]").unwrap().len(), 1);
    }

    #[test]
    fn invalid_grid_searches_are_rejected_with_line_numbers() {
        let error_of = |text: &str| variants(text).unwrap_err().to_string();
        let no_list = error_of("size: 8\nseed:\n  grid_search: 5\n");
        assert!(no_list.contains("line 3: `seed`"), "{no_list}");
        let twins = "a:\n  seed: {grid_search: [1]}\nb:\n  seed: {grid_search: [2]}\n";
        assert!(error_of(twins).contains("line 4: `a.seed` and `b.seed`"));
        assert!(error_of("grid_search: [1]").contains("belongs below a field"));
        let beside = error_of("seed: {grid_search: [1], default: 2}");
        assert!(beside.contains("line 1: `seed`: unknown key `default` beside `grid_search`"), "{beside}");
        let list = format!("{{grid_search: {:?}}}", (0..10_000).collect::<Vec<_>>());
        let many = [0, 1, 2, 3, 4].map(|at| format!("field{at}: {list}\n")).concat();
        let many = error_of(&many);
        assert!(
            many.ends_with("10000 x 10000 x 10000 x 10000 x 10000 combinations, expected at most 10000000"),
            "{many}"
        );
    }
}
