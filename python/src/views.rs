//! Tables and plots of results.

use std::path::PathBuf;

use pogema_core::{Error, Words};
use pogema_toolbox::views::{self, Format, Gallery, ImageFormat, ShownView};
use pogema_toolbox::{Results, six::Definition};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::guard::guarded;
use crate::{errors, interrupt};

/// A view: its name, its tables, the files of its plots, notes, and the error if it could not be shown.
type Listed = (String, Vec<String>, Vec<PathBuf>, Vec<String>, Option<String>);

guarded! {
/// Checks the views in a JSON text with a field `results_views`.
#[pyfunction]
pub fn check_views(text: &str) -> PyResult<()> {
    views::parse_views(text).map(|_| ()).map_err(|error| PyValueError::new_err(error.to_string()))
}
}

guarded! {
/// Shows views of the results in folders. Returns notes on incomplete results, and then the views.
///
/// Without `names`, shows all views of `config` [default: the suite that is stored with the results]. Instead of
/// `folders`, `rows` may hold the results in JSON and the name of their folder. `options` are the formats of tables and
/// plots, and the definition of the six metrics.
#[pyfunction]
pub fn show_views(
    py: Python<'_>,
    folders: Vec<PathBuf>,
    config: Option<PathBuf>,
    names: Vec<String>,
    options: (Option<String>, Option<String>, Option<String>),
    out: Option<PathBuf>,
    rows: Option<(String, String)>,
) -> PyResult<(Vec<String>, Vec<Listed>)> {
    let (table_format, plot_format, six) = options;
    let show = move || {
        let gallery = Gallery {
            format: table_format.map(|word| Format::read("table_format", &word)).transpose()?,
            kind: plot_format.map(|word| ImageFormat::read("plot_format", &word)).transpose()?,
            definition: six.map(|word| Definition::read("six", &word)).transpose()?,
            folder: out,
            ..Gallery::of(&folders, config.as_deref(), &names)?
        };
        let results = match rows {
            Some((text, set)) => Results::parse(&text, &set)?,
            None => Results::read(&folders)?,
        };
        let listed = gallery.views.iter().map(|(name, view)| {
            let (shown, error) = match gallery.show(name, view, &results) {
                Ok(shown) => (shown, None),
                Err(error) => (ShownView::default(), Some(error.to_string())),
            };
            (name.clone(), shown.tables, shown.files, shown.notes, error)
        });
        let listed = listed.collect();
        Ok((results.notes, listed))
    };
    interrupt::detach(py, show)?.map_err(|error: Error| errors::file(&error))
}
}
