//! Tables, plots and pages of results.

use std::path::PathBuf;

use pogema_core::Error;
use pogema_toolbox::views::{Format, Gallery, Kind, Told};
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
            format: formats.0.as_deref().map(table_format).transpose()?,
            kind: formats.1.as_deref().map(plot_format).transpose()?,
            definition: six.as_deref().map(definition).transpose()?,
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

fn table_format(name: &str) -> Result<Format, Error> {
    match name {
        "terminal" => Ok(Format::Terminal),
        "markdown" => Ok(Format::Markdown),
        "latex" => Ok(Format::Latex),
        "csv" => Ok(Format::Csv),
        _ => Err(Error::config("table_format", name, "`terminal`, `markdown`, `latex` or `csv`")),
    }
}

fn plot_format(name: &str) -> Result<Kind, Error> {
    match name {
        "svg" => Ok(Kind::Svg),
        "pdf" => Ok(Kind::Pdf),
        "png" => Ok(Kind::Png),
        _ => Err(Error::config("plot_format", name, "`svg`, `pdf` or `png`")),
    }
}

fn definition(name: &str) -> Result<Definition, Error> {
    match name {
        "published" => Ok(Definition::Published),
        "paper" => Ok(Definition::Paper),
        _ => Err(Error::config("six", name, "`published` or `paper`")),
    }
}
