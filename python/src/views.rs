//! Tables, plots and pages of results.

use std::path::PathBuf;

use pogema_core::Error;
use pogema_toolbox::views::{Format, Gallery, ImageFormat, Told};
use pogema_toolbox::{Results, six::Definition};
use pyo3::prelude::*;

use crate::evaluation::told;

/// A view: its name, its tables, the files of its plots, notes, and why it could not be shown.
type Listed = (String, Vec<String>, Vec<PathBuf>, Vec<String>, Option<String>);

/// Shows views of the results in folders, by default all of those that are with them; what the results lack is told
/// first.
#[pyfunction]
pub fn show_views(
    py: Python<'_>,
    folders: Vec<PathBuf>,
    config: Option<PathBuf>,
    names: Vec<String>,
    formats: (Option<String>, Option<String>),
    out: Option<PathBuf>,
    six: Option<String>,
) -> PyResult<(Vec<String>, Vec<Listed>)> {
    let show = || {
        let gallery = Gallery {
            format: named("table_format", formats.0.as_deref(), &TABLE_FORMATS)?,
            kind: named("plot_format", formats.1.as_deref(), &PLOT_FORMATS)?,
            definition: named("six", six.as_deref(), &DEFINITIONS)?,
            folder: out,
            ..Gallery::of(&folders, config.as_deref(), &names)?
        };
        let results = Results::read(&folders)?;
        let listed = gallery.views.iter().map(|(name, view)| {
            let (told, error) = match gallery.show(name, view, &results) {
                Ok(told) => (told, None),
                Err(error) => (Told::default(), Some(error.to_string())),
            };
            (name.clone(), told.tables, told.files, told.notes, error)
        });
        let listed = listed.collect();
        Ok((results.notes, listed))
    };
    py.detach(show).map_err(|error: Error| told(&error))
}

const TABLE_FORMATS: [(&str, Format); 4] = [
    ("terminal", Format::Terminal),
    ("markdown", Format::Markdown),
    ("latex", Format::Latex),
    ("csv", Format::Csv),
];
const PLOT_FORMATS: [(&str, ImageFormat); 3] =
    [("svg", ImageFormat::Svg), ("pdf", ImageFormat::Pdf), ("png", ImageFormat::Png)];
const DEFINITIONS: [(&str, Definition); 2] =
    [("published", Definition::Published), ("paper", Definition::Paper)];

/// What stands for one of some names, if it is said at all.
fn named<T: Copy>(option: &str, name: Option<&str>, known: &[(&str, T)]) -> Result<Option<T>, Error> {
    let Some(name) = name else { return Ok(None) };
    if let Some(&(_, found)) = known.iter().find(|(known, _)| *known == name) {
        return Ok(Some(found));
    }
    let names: Vec<String> = known.iter().map(|(name, _)| format!("`{name}`")).collect();
    Err(Error::argument(option, name, names.join(", ")))
}
