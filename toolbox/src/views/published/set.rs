//! The results of one folder, and the published ones of the same instances.

use std::collections::{BTreeMap, BTreeSet};

use pogema_core::Error;
use serde_json::Value;

use crate::frame::shown;
use crate::results::Row;
use crate::views::pairing::Pairing;

/// The column of the number of agents.
pub(super) const NUM_AGENTS: &str = "num_agents";

/// A folder of results with what is published on its instances.
pub(super) struct Set<'a> {
    /// The name of the folder.
    pub folder: &'a str,
    /// The published rows, if there are any.
    pub published: Option<Vec<Row>>,
}

impl<'a> Set<'a> {
    /// Sorts rows by folder and number of agents.
    pub fn crowds(rows: impl Iterator<Item = &'a Row>) -> BTreeMap<&'a str, BTreeMap<u64, Vec<&'a Row>>> {
        let mut folders: BTreeMap<&str, BTreeMap<u64, Vec<&Row>>> = BTreeMap::new();
        for row in rows {
            // POGEMA's default stands for what is not given.
            let num_agents = row.field(NUM_AGENTS).and_then(Value::as_u64).unwrap_or(1);
            folders.entry(&row.set).or_default().entry(num_agents).or_default().push(row);
        }
        folders
    }

    /// Pairs rows with the published rows of the same instances, which are known by all fields that vary there.
    pub fn pairing<'r>(&'r self, rows: &[&'r Row]) -> Option<Pairing<'r>> {
        let columns = self.columns()?;
        let key = |row: &Row| {
            let fields = columns.iter().map(|&column| shown(row.field(column).unwrap_or(&Value::Null)));
            fields.collect::<Vec<_>>().join(", ")
        };
        Some(Pairing::of(rows.iter().copied(), self.published.iter().flatten(), key))
    }

    /// Passes if no field varies here that does not vary in the published rows.
    ///
    /// # Errors
    /// Names the field: different instances here would be taken for the same published one.
    pub fn check_columns(&self, view: &str, rows: impl Iterator<Item = &'a Row>) -> Result<(), Error> {
        let Some(columns) = self.columns() else { return Ok(()) };
        let mut values: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
        for (name, value) in rows.flat_map(|row| row.settings.iter()) {
            values.entry(name).or_default().insert(shown(value));
        }
        let mut unknown = values.iter().filter(|(name, values)| values.len() > 1 && !columns.contains(*name));
        let Some((name, values)) = unknown.next() else { return Ok(()) };
        let reason = format!(
            "view `{view}`: `{name}` has {} values in `{}` and is not varied in the published episodes",
            values.len(),
            self.folder
        );
        Err(Error::Request { reason })
    }

    /// The fields that vary in the published rows.
    fn columns(&self) -> Option<BTreeSet<&str>> {
        let rows = self.published.as_ref()?;
        Some(rows.iter().flat_map(|row| row.settings.iter().map(|(name, _)| name)).collect())
    }
}
