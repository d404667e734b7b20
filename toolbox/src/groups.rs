//! Groups of rows, and the values of their metrics.

use std::cmp::Ordering;
use std::collections::HashMap;

use serde_json::Value;

use crate::results::{ALGORITHM, Row};

/// Rows with equal values in some columns.
#[derive(Clone, Debug)]
pub struct Group<'a> {
    /// The values in these columns, null if missing.
    pub keys: Vec<Value>,
    /// The rows in their original order.
    pub rows: Vec<&'a Row>,
}

/// Groups rows by some columns; the groups are sorted by the values in these columns (see [`compare`]).
pub fn group_by<'a>(rows: impl IntoIterator<Item = &'a Row>, columns: &[String]) -> Vec<Group<'a>> {
    let mut places: HashMap<String, usize> = HashMap::new();
    let mut groups: Vec<Group<'a>> = Vec::new();
    for row in rows {
        let keys: Vec<Value> = columns.iter().map(|column| row.key(column).unwrap_or_default()).collect();
        let place = *places.entry(Value::from(keys.clone()).to_string()).or_insert(groups.len());
        match groups.get_mut(place) {
            Some(group) => group.rows.push(row),
            None => groups.push(Group { keys, rows: vec![row] }),
        }
    }
    groups.sort_by(|one, other| {
        let pairs = one.keys.iter().zip(&other.keys);
        pairs.map(|(one, other)| compare(one, other)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
    });
    groups
}

/// Compares values for the order of tables: numbers by size, with booleans as 0 and 1, then texts, then lists and
/// objects, then missing values.
pub fn compare(one: &Value, other: &Value) -> Ordering {
    let rank = |value: &Value| match value {
        Value::Bool(_) | Value::Number(_) => 0,
        Value::String(_) => 1,
        Value::Array(_) | Value::Object(_) => 2,
        Value::Null => 3,
    };
    let number = |value: &Value| value.as_bool().map(f64::from).or(value.as_f64());
    match (number(one), number(other), one, other) {
        (Some(one), Some(other), ..) => one.total_cmp(&other),
        (_, _, Value::String(one), Value::String(other)) => one.cmp(other),
        _ => rank(one).cmp(&rank(other)).then_with(|| one.to_string().cmp(&other.to_string())),
    }
}

/// Formats a value for display: texts without quotes, an empty text for null.
pub fn shown(value: &Value) -> String {
    if value.is_null() { String::new() } else { plain_text(value) }
}

/// Formats a value as JSON, but texts without quotes.
pub(crate) fn plain_text(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// Returns the values of a metric, skipping rows without it.
pub fn values(rows: &[&Row], metric: &str) -> Vec<f64> {
    rows.iter().filter_map(|row| row.metric(metric)).collect()
}

/// Returns a note for each algorithm and each metric that some of its rows lack, with the number of these rows.
pub fn lacking<'a>(rows: impl IntoIterator<Item = &'a Row>, metrics: &[String]) -> Vec<String> {
    let mut notes = Vec::new();
    for Group { keys, rows } in group_by(rows, &[ALGORITHM.to_owned()]) {
        for metric in metrics {
            let (lacking, all) = (rows.len() - values(&rows, metric).len(), rows.len());
            if lacking > 0 {
                let algorithm = shown(&keys[0]);
                notes.push(format!(
                    "`{algorithm}` has no `{metric}` in {lacking} of {all} rows; these rows are left out"
                ));
            }
        }
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(settings: &str, metrics: &str) -> Row {
        let text = format!(r#"{{"metrics": {metrics}, "env_grid_search": {settings}, "algorithm": "A"}}"#);
        serde_json::from_str(&text).unwrap()
    }

    #[test]
    fn groups_are_sorted_with_missing_values_last() {
        let rows = ["{\"n\": 16}", "{}", "{\"n\": 8}", "{\"n\": 16}", "{\"n\": \"all\"}"];
        let rows: Vec<Row> = rows.iter().map(|settings| row(settings, "{}")).collect();
        let groups = group_by(&rows, &["n".to_owned()]);
        let found: Vec<(String, usize)> =
            groups.iter().map(|group| (shown(&group.keys[0]), group.rows.len())).collect();
        let expected = [("8", 1), ("16", 2), ("all", 1), ("", 1)];
        assert_eq!(found, expected.map(|(key, count)| (key.to_owned(), count)));
    }

    #[test]
    fn rows_without_a_metric_are_noted() {
        let rows = [row("{}", "{\"SoC\": 4}"), row("{}", "{\"SoC\": null}"), row("{}", "{\"SoC\": [1]}")];
        let all: Vec<&Row> = rows.iter().collect();
        assert_eq!(values(&all, "SoC"), [4.0]);
        let notes = lacking(&rows, &["SoC".to_owned()]);
        assert_eq!(notes, ["`A` has no `SoC` in 2 of 3 rows; these rows are left out"]);
    }
}
