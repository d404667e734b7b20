//! Tables and plots of results, as described by a file of views.
//!
//! A [`Gallery`] shows all views of a file; [`View::show`] shows [`Results`] in one view.

mod axes;
mod boxes;
mod cactus;
mod compare;
mod compose;
mod decisions;
mod difference;
mod gallery;
mod image_format;
mod legend;
mod means;
mod options;
mod page;
mod pairing;
mod picture;
mod plot;
mod published;
mod radar;
mod ratios;
mod seeds;
mod series;
mod style;
mod table;
mod tabular;

use std::path::Path;

use pogema_core::Error;
use pogema_maps::did_you_mean;
use pogema_maps::files::read_text;

pub use boxes::BoxView;
pub use cactus::CactusView;
pub use compare::CompareView;
pub use difference::DifferenceView;
pub use gallery::{Gallery, ShownView, distinct_files};
pub use image_format::ImageFormat;
pub use picture::Picture;
pub use plot::PlotView;
pub use published::PublishedView;
pub use radar::RadarView;
pub use ratios::RatiosView;
pub use seeds::SeedsView;
pub use table::{Cell, Format, Table};
pub use tabular::TableView;

use crate::manifest::Manifest;
use crate::results::Results;
use crate::six::Definition;
use crate::store::SUITE;
use crate::suite::{Suite, in_file, missing_field, wrong};
use crate::tree::Node;

/// The field of a file that holds the views by name.
const VIEWS: &str = "results_views";

/// The types of views.
const TYPES: [&str; 11] = [
    "tabular",
    "plot",
    "multi-plot",
    "radar",
    "box",
    "cactus",
    "compare",
    "difference",
    "seeds",
    "published",
    "ratios",
];

/// One view of results.
#[derive(Clone, Debug)]
pub enum View {
    /// `type: tabular`
    Table(TableView),
    /// `type: plot`, `type: multi-plot`
    Plot(Box<PlotView>),
    /// `type: radar`
    Radar(Box<RadarView>),
    /// `type: box`
    Box(Box<BoxView>),
    /// `type: cactus`
    Cactus(Box<CactusView>),
    /// `type: compare`
    Compare(Box<CompareView>),
    /// `type: difference`
    Difference(DifferenceView),
    /// `type: seeds`
    Seeds(SeedsView),
    /// `type: published`
    Published(Box<PublishedView>),
    /// `type: ratios`
    Ratios(RatiosView),
}

/// The output of a view.
#[derive(Debug, Default)]
pub struct Shown {
    /// Its tables.
    pub tables: Vec<Table>,
    /// Its plots.
    pub pictures: Vec<Picture>,
    /// Notes on omitted or suspicious data, one line each.
    pub notes: Vec<String>,
}

/// Reads the views of a file and ignores its other fields.
///
/// # Errors
/// One line with the file, the line and the key of the error.
pub fn read_views(path: &Path) -> Result<Vec<(String, View)>, Error> {
    let views = parse_views(&read_text(path)?).map_err(|error| in_file(path, error))?;
    // In the suite saved with results, paths are relative to the folder of the original file.
    let copied = if path.file_name().is_some_and(|name| name == SUITE) { path.parent() } else { None };
    let original = copied.and_then(|folder| Manifest::read(folder).ok().flatten()).map(|known| known.suite);
    let origin = original.as_deref().unwrap_or(path);
    Ok(views.into_iter().map(|(name, view)| (name, view.beside(origin))).collect())
}

/// Reads the views of a text, leaves the paths in the views unchanged, and ignores the other fields of the text.
///
/// # Errors
/// One line with the line and the key of the error.
pub fn parse_views(text: &str) -> Result<Vec<(String, View)>, Error> {
    let root = Node::parse(text)?;
    let missing = || Error::Syntax { reason: format!("expected a field `{VIEWS}`") };
    let node = root.field(VIEWS).ok_or_else(missing)?;
    let fields = node.fields().ok_or_else(|| wrong(node, VIEWS, "names and their fields"))?;
    fields.iter().map(|(name, node)| Ok((name.clone(), View::read(name, node)?))).collect()
}

/// Checks the views of a suite, so that an invalid view is reported before any episode is played.
///
/// # Errors
/// One line with the file, the line and the key of the error.
pub fn check_views(suite: &Suite) -> Result<(), Error> {
    for (name, node) in &suite.views {
        View::read(name, node).map_err(|error| suite.in_file(error))?;
    }
    Ok(())
}

impl View {
    /// Reads a view from its fields.
    ///
    /// # Errors
    /// One line with the line and the key of the error.
    pub fn read(name: &str, node: &Node) -> Result<Self, Error> {
        let kind = node.field("type").ok_or_else(|| missing_field(node, name, "type"))?;
        match kind.text().unwrap_or_default() {
            "tabular" => TableView::read(name, node).map(Self::Table),
            kind @ ("plot" | "multi-plot") => {
                PlotView::read(name, node, kind == "multi-plot").map(|view| Self::Plot(Box::new(view)))
            }
            "radar" => RadarView::read(name, node).map(|view| Self::Radar(Box::new(view))),
            "box" => BoxView::read(name, node).map(|view| Self::Box(Box::new(view))),
            "cactus" => CactusView::read(name, node).map(|view| Self::Cactus(Box::new(view))),
            "compare" => CompareView::read(name, node).map(|view| Self::Compare(Box::new(view))),
            "difference" => DifferenceView::read(name, node).map(Self::Difference),
            "seeds" => SeedsView::read(name, node).map(Self::Seeds),
            "published" => PublishedView::read(name, node).map(|view| Self::Published(Box::new(view))),
            "ratios" => RatiosView::read(name, node).map(Self::Ratios),
            other => {
                let hint = kind.text().map_or_else(String::new, |_| did_you_mean(other, TYPES));
                Err(wrong(kind, &format!("{name}.type"), &format!("one of {}{hint}", TYPES.join(", "))))
            }
        }
    }

    /// Resolves the view's paths relative to the folder of the file that holds the view.
    #[must_use]
    pub fn beside(mut self, file: &Path) -> Self {
        let folder = file.parent().unwrap_or(Path::new(""));
        match &mut self {
            Self::Published(view) => view.beside(folder),
            Self::Ratios(view) => view.beside(folder),
            _ => {}
        }
        self
    }

    /// Returns the format of the view's tables, if the view has tables with a format.
    pub fn format(&self) -> Option<Format> {
        match self {
            Self::Table(view) => Some(view.format),
            _ => None,
        }
    }

    /// Makes the tables and plots; the name is for messages.
    ///
    /// If `definition` is given, it overrides that of a radar view.
    ///
    /// # Errors
    /// If the results lack data that the view needs.
    pub fn show(
        &self,
        name: &str,
        results: &Results,
        definition: Option<Definition>,
    ) -> Result<Shown, Error> {
        match self {
            Self::Table(view) => view.show(name, results),
            Self::Plot(view) => view.show(name, results),
            Self::Radar(view) => view.show(name, results, definition),
            Self::Box(view) => view.show(name, results),
            Self::Cactus(view) => view.show(name, results),
            Self::Compare(view) => view.show(name, results),
            Self::Difference(view) => view.show(name, results),
            Self::Seeds(view) => view.show(name, results),
            Self::Published(view) => view.show(name, results),
            Self::Ratios(view) => view.show(name, results),
        }
    }
}

/// Checks that the results have a column.
fn known_column(view: &str, key: &str, column: &str, results: &Results) -> Result<(), Error> {
    let columns = results.key_columns().into_iter().chain(results.metric_columns()).collect();
    known(view, key, column, "a column of the results", columns)
}

/// Checks that the results have a metric.
fn known_metric(view: &str, key: &str, metric: &str, results: &Results) -> Result<(), Error> {
    known(view, key, metric, "a metric of the results", results.metric_columns())
}

fn known(view: &str, key: &str, column: &str, expected: &str, columns: Vec<String>) -> Result<(), Error> {
    if columns.iter().any(|known| known == column) {
        return Ok(());
    }
    Err(unknown_name(view, key, column, expected, columns.iter().map(String::as_str)))
}

/// Returns an error about an option whose value is not one of the known names.
fn unknown_name<'a>(
    view: &str,
    key: &str,
    found: &str,
    expected: &str,
    known: impl IntoIterator<Item = &'a str>,
) -> Error {
    let hint = did_you_mean(found, known);
    Error::request(format!("view `{view}`: `{key}` is `{found}`, expected {expected}{hint}"))
}
