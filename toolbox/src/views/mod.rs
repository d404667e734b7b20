//! Tables and plots of results, as a file of views asks for them.
//!
//! [`read_views`] reads the file; [`View::show`] makes of [`Results`] what one view asks for.

mod axes;
mod grid;
mod legend;
mod options;
mod panel;
mod picture;
mod plot;
mod series;
mod style;
mod table;

use std::path::Path;

use pogema_core::Error;
use pogema_maps::nearest;

pub use grid::{Cell, Format, Table};
pub use picture::{Kind, Picture};
pub use plot::PlotView;
pub use table::TableView;

use crate::results::Results;
use crate::suite::wrong;
use crate::tree::Node;

/// The field of a file that has the views by name.
const VIEWS: &str = "results_views";

/// The types of views.
const TYPES: [&str; 3] = ["tabular", "plot", "multi-plot"];

/// One way to look at results.
#[derive(Clone, Debug)]
pub enum View {
    /// `type: tabular`
    Table(TableView),
    /// `type: plot`, `type: multi-plot`
    Plot(Box<PlotView>),
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
    let in_file = |error: Error| match error {
        Error::Syntax { reason } | Error::State { reason } => Error::io(path, reason),
        error => Error::io(path, error),
    };
    let root = Node::parse(&text).map_err(in_file)?;
    let Some(node) = root.field(VIEWS) else {
        return Err(Error::io(path, format!("expected a field `{VIEWS}`")));
    };
    let fields = node.fields().ok_or_else(|| in_file(wrong(node, VIEWS, "names and their fields")))?;
    let views = fields.iter().map(|(name, node)| Ok((name.clone(), View::read(name, node)?)));
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
            other => {
                let hint = nearest(other, TYPES).unwrap_or_default();
                let types = TYPES.join(", ");
                let expected = format!("one of {types} (such as `{hint}`), found `{other}`");
                Err(wrong(kind, &format!("{name}.type"), &expected))
            }
        }
    }

    /// The format of its tables, if it asks for one.
    pub fn format(&self) -> Option<Format> {
        match self {
            Self::Table(view) => Some(view.format),
            Self::Plot(_) => None,
        }
    }

    /// Makes what it shows; its name is for messages and titles.
    ///
    /// # Errors
    /// If the results do not have what it needs.
    pub fn show(&self, name: &str, results: &Results) -> Result<Shown, Error> {
        match self {
            Self::Table(view) => view.show(name, results),
            Self::Plot(view) => view.show(name, results),
        }
    }
}

/// An error about an option that names no column of the results.
fn named<'a>(view: &str, key: &str, column: &str, known: impl IntoIterator<Item = &'a str>) -> Error {
    let hint = nearest(column, known).map(|hint| format!("; the nearest column is `{hint}`"));
    let hint = hint.unwrap_or_default();
    Error::State {
        reason: format!("view `{view}`: `{key}` is `{column}`, expected a column of the results{hint}"),
    }
}
