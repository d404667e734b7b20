//! Checks that all algorithms have played the same instances.

use pogema_core::{Error, counted};

use super::Shown;
use super::options::{Common, Options};
use super::table::{Cell, Table};
use crate::groups::group_by;
use crate::results::{ALGORITHM, Results};
use crate::tree::Node;

/// Title of the column with the folder, shown if there are several folders.
const FOLDER: &str = "Folder";

/// `type: seeds`: a table of the instances that an algorithm lacks or has more than once; no table if there are none.
///
/// All varied fields identify an instance; pogema-toolbox compares only map, number of agents and seed.
///
/// Source: pogema-toolbox 0.1.1, `view_utils.py`, `check_seeds`
#[derive(Clone, Debug)]
pub struct SeedsView {
    common: Common,
}

impl SeedsView {
    pub(super) fn read(name: &str, node: &Node) -> Result<Self, Error> {
        Ok(Self { common: Common::read(&Options::new(name, node, &[])?)? })
    }

    /// Checks each folder separately.
    #[allow(clippy::unnecessary_wraps, reason = "the same signature as in the other views")]
    pub(super) fn show(&self, name: &str, results: &Results) -> Result<Shown, Error> {
        let keys: Vec<String> = results.key_columns().into_iter().filter(|key| key != ALGORITHM).collect();
        let algorithms = results.algorithms();
        let folders = results.by_folder();
        let has_folders = folders.len() > 1;
        let (mut rows, mut problems, mut instances) = (Vec::new(), 0, 0);
        for (set, of_set) in folders {
            for group in group_by(of_set, &keys) {
                instances += 1;
                let counts: Vec<usize> = algorithms
                    .iter()
                    .map(|algorithm| group.rows.iter().filter(|row| row.algorithm == *algorithm).count())
                    .collect();
                let wrong = counts.iter().filter(|&&count| count != 1).count();
                if wrong == 0 {
                    continue;
                }
                problems += wrong;
                let folder = has_folders.then(|| set.to_owned());
                let places = keys.iter().zip(&group.keys).map(|(key, value)| self.common.shown(key, value));
                let states = counts.into_iter().map(state);
                rows.push(folder.into_iter().chain(places).chain(states).map(Cell::Text).collect());
            }
        }
        if rows.is_empty() {
            let note = format!("view `{name}`: every algorithm has each instance once, {instances} in all");
            return Ok(Shown { notes: vec![note], ..Shown::default() });
        }
        let folder = has_folders.then(|| FOLDER.to_owned());
        let keys = keys.iter().map(|key| self.common.title(key));
        let names = algorithms.iter().map(|name| self.common.algorithm(name));
        let head = folder.into_iter().chain(keys).chain(names).collect();
        let remark = Some(format!(
            "{} of {} missing or duplicated",
            counted(problems, "result"),
            counted(instances, "instance")
        ));
        Ok(Shown { tables: vec![Table { head, rows, remark, ..Table::default() }], ..Shown::default() })
    }
}

/// Returns the text for the number of an algorithm's results on an instance.
fn state(count: usize) -> String {
    match count {
        0 => "missing".to_owned(),
        1 => "ok".to_owned(),
        count => format!("x{count}"),
    }
}
