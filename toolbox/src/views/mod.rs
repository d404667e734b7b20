//! Tables and plots of results, as a file of views asks for them.
//!
//! A [`Gallery`] shows all views of a file; [`View::show`] makes of [`Results`] what one view asks for.

mod axes;
mod boxes;
mod cactus;
mod compare;
mod compose;
mod gallery;
mod grid;
mod image_format;
mod legend;
mod means;
mod options;
mod pairing;
mod panel;
mod picture;
mod plot;
mod published;
mod radar;
mod seeds;
mod series;
mod style;
mod table;

use std::path::Path;

use pogema_core::Error;
use pogema_maps::nearest;

pub use boxes::BoxView;
pub use cactus::CactusView;
pub use compare::CompareView;
pub use gallery::{Gallery, ShownView};
pub use grid::{Cell, Format, Table};
pub use image_format::ImageFormat;
pub use picture::Picture;
pub use plot::PlotView;
pub use published::PublishedView;
pub use radar::RadarView;
pub use seeds::SeedsView;
pub use table::TableView;

use crate::manifest::Manifest;
use crate::results::Results;
use crate::six::Definition;
use crate::store::SUITE;
use crate::suite::{in_file, wrong};
use crate::tree::Node;

/// The field of a file that has the views by name.
const VIEWS: &str = "results_views";

/// The types of views.
const TYPES: [&str; 9] =
    ["tabular", "plot", "multi-plot", "radar", "box", "cactus", "compare", "seeds", "published"];

/// One way to look at results.
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
    /// `type: seeds`
    Seeds(SeedsView),
    /// `type: published`
    Published(Box<PublishedView>),
}

/// What a view shows.
#[derive(Debug, Default)]
pub struct Shown {
    /// Its tables.
    pub tables: Vec<Table>,
    /// Its plots.
    pub pictures: Vec<Picture>,
    /// What was left out or looks wrong, a line each.
    pub notes: Vec<String>,
}

/// Reads the views of a file, whatever else is in it.
///
/// # Errors
/// One line with the file, the line and the key of what is wrong.
pub fn read_views(path: &Path) -> Result<Vec<(String, View)>, Error> {
    let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, error))?;
    let in_file = |error: Error| in_file(path, error);
    let root = Node::parse(&text).map_err(in_file)?;
    let Some(node) = root.field(VIEWS) else {
        return Err(Error::io(path, format!("expected a field `{VIEWS}`")));
    };
    let fields = node.fields().ok_or_else(|| in_file(wrong(node, VIEWS, "names and their fields")))?;
    // What the suite of results names lies beside the file that it was copied from.
    let copied = if path.file_name().is_some_and(|name| name == SUITE) { path.parent() } else { None };
    let original = copied.and_then(|folder| Manifest::read(folder).ok().flatten()).map(|known| known.suite);
    let origin = original.as_deref().unwrap_or(path);
    let views = fields.iter().map(|(name, node)| Ok((name.clone(), View::read(name, node)?.beside(origin))));
    views.collect::<Result<_, _>>().map_err(in_file)
}

impl View {
    /// Reads a view's fields.
    ///
    /// # Errors
    /// One line with the line and the key of what is wrong.
    pub fn read(name: &str, node: &Node) -> Result<Self, Error> {
        let kind = node.field("type").ok_or_else(|| wrong(node, name, "a field `type`"))?;
        match kind.text().unwrap_or_default() {
            "tabular" => TableView::read(name, node).map(Self::Table),
            kind @ ("plot" | "multi-plot") => {
                PlotView::read(name, node, kind == "multi-plot").map(|view| Self::Plot(Box::new(view)))
            }
            "radar" => RadarView::read(name, node).map(|view| Self::Radar(Box::new(view))),
            "box" => BoxView::read(name, node).map(|view| Self::Box(Box::new(view))),
            "cactus" => CactusView::read(name, node).map(|view| Self::Cactus(Box::new(view))),
            "compare" => CompareView::read(name, node).map(|view| Self::Compare(Box::new(view))),
            "seeds" => SeedsView::read(name, node).map(Self::Seeds),
            "published" => PublishedView::read(name, node).map(|view| Self::Published(Box::new(view))),
            other => {
                let hint = nearest(other, TYPES).unwrap_or_default();
                let types = TYPES.join(", ");
                let expected = format!("one of {types} (such as `{hint}`), found `{other}`");
                Err(wrong(kind, &format!("{name}.type"), &expected))
            }
        }
    }

    /// Takes the paths of files that it names as relative to the folder of the file that holds it.
    #[must_use]
    pub fn beside(mut self, file: &Path) -> Self {
        if let Self::Published(view) = &mut self {
            view.beside(file.parent().unwrap_or(Path::new("")));
        }
        self
    }

    /// The format of its tables, if it asks for one.
    pub fn format(&self) -> Option<Format> {
        match self {
            Self::Table(view) => Some(view.format),
            _ => None,
        }
    }

    /// Makes what it shows; its name is for messages.
    ///
    /// A definition of the six metrics that is given has precedence over that of a radar view.
    ///
    /// # Errors
    /// If the results do not have what it needs.
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
            Self::Seeds(view) => view.show(name, results),
            Self::Published(view) => view.show(name, results),
        }
    }
}

/// Passes if the results have a column.
fn known_column(view: &str, key: &str, column: &str, results: &Results) -> Result<(), Error> {
    let columns: Vec<String> = results.key_columns().into_iter().chain(results.metric_columns()).collect();
    if columns.iter().any(|known| known == column) {
        return Ok(());
    }
    Err(named(view, key, column, columns.iter().map(String::as_str)))
}

/// An error about an option that names no column of the results.
fn named<'a>(view: &str, key: &str, column: &str, known: impl IntoIterator<Item = &'a str>) -> Error {
    let hint = nearest(column, known).map(|hint| format!("; the nearest column is `{hint}`"));
    let hint = hint.unwrap_or_default();
    Error::request(format!("view `{view}`: `{key}` is `{column}`, expected a column of the results{hint}"))
}
