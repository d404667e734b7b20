//! Lines of means, one for each algorithm or each value of another column.

use kuva::plot::band::BandPlot;
use kuva::plot::line::{LinePlot, LineStyle};
use kuva::plot::scatter::{MarkerShape, ScatterPlot};
use kuva::render::plots::Plot;
use serde_json::Value;

use super::legend::Entry;
use super::style::Style;
use crate::bootstrap::{Estimate, Spread};
use crate::groups::{compare, values};
use crate::results::{Row, figure};

/// Dash patterns of lines; the first is solid.
const DASHES: [&str; 7] = ["", "5 2", "1.5 1.5", "5 2 1.5 2", "7 3", "3 1", "1.5 4"];

/// Markers that are easy to distinguish even when small.
const MARKERS: [MarkerShape; 8] = [
    MarkerShape::Circle,
    MarkerShape::Square,
    MarkerShape::Triangle,
    MarkerShape::Diamond,
    MarkerShape::TriangleDown,
    MarkerShape::Pentagon,
    MarkerShape::Cross,
    MarkerShape::Plus,
];

/// One line.
#[derive(Clone, Debug)]
pub(super) struct Series {
    /// Its index among all lines of the plot, which determines its colour, marker and dash pattern.
    pub number: usize,
    /// Its points: the position on the horizontal axis, and the mean there.
    pub points: Vec<(f64, Estimate)>,
}

/// The kind of values on the horizontal axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Places {
    /// Numbers, each at its own position.
    Numbers,
    /// Other values, side by side.
    Names(Vec<Value>),
}

impl Places {
    /// Returns the kind of values in a column; rows without a value that can be shown are ignored.
    pub fn of<'a>(rows: impl IntoIterator<Item = &'a Row>, column: &str) -> Self {
        let found = distinct(rows, column);
        if found.iter().all(Value::is_number) { Self::Numbers } else { Self::Names(found) }
    }

    fn place(&self, value: &Value) -> Option<f64> {
        match self {
            Self::Numbers => figure(value),
            Self::Names(names) => {
                names.iter().position(|name| compare(name, value).is_eq()).map(|place| place as f64)
            }
        }
    }
}

/// Returns the distinct values of a column, sorted.
pub(super) fn distinct<'a>(rows: impl IntoIterator<Item = &'a Row>, column: &str) -> Vec<Value> {
    let mut found: Vec<Value> = rows.into_iter().filter_map(|row| at(row, column)).collect();
    found.sort_by(compare);
    found.dedup_by(|one, other| compare(one, other).is_eq());
    found
}

/// Returns whether a row has the given value in a column. Numbers with equal values, such as 1 and 1.0, are equal.
pub(super) fn has(row: &Row, column: &str, value: &Value) -> bool {
    at(row, column).is_some_and(|found| compare(&found, value).is_eq())
}

/// Returns the value of a row in a column, metric or not; `None` if it cannot be shown.
pub(super) fn at(row: &Row, column: &str) -> Option<Value> {
    let value = row.key(column).or_else(|| row.metrics.get(column).cloned())?;
    let is_shown =
        if value.is_number() { figure(&value).is_some() } else { !value.is_null() && !value.is_array() };
    is_shown.then_some(value)
}

/// Returns a note for each column in which rows lack a value, with the number of these rows; they are not drawn.
pub(super) fn placeless<'a>(rows: &[Row], columns: impl IntoIterator<Item = &'a String>) -> Vec<String> {
    let lacking = |column: &String| rows.iter().filter(|row| at(row, column).is_none()).count();
    let counts =
        columns.into_iter().map(|column| (column, lacking(column))).filter(|(_, lacking)| *lacking > 0);
    counts
        .map(|(column, lacking)| {
            format!("{lacking} of {} rows have no value in `{column}` and are not drawn", rows.len())
        })
        .collect()
}

/// Computes the mean of a metric at each position, with its interval.
pub(super) fn means(
    rows: &[&Row],
    x: &str,
    places: &Places,
    y: &str,
    spread: Spread,
) -> Vec<(f64, Estimate)> {
    let mut points: Vec<(f64, Vec<&Row>)> = Vec::new();
    for row in rows {
        let Some(place) = at(row, x).and_then(|value| places.place(&value)) else { continue };
        match points.iter_mut().find(|(known, _)| *known == place) {
            Some((_, rows)) => rows.push(row),
            None => points.push((place, vec![row])),
        }
    }
    points.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    let estimates = points.into_iter().enumerate().filter_map(|(number, (place, rows))| {
        Some((place, Estimate::of(&values(&rows, y), spread, number as u64)?))
    });
    estimates.collect()
}

impl Series {
    /// Returns the elements that the library draws for the line.
    pub fn plots(&self, style: &Style) -> Vec<Plot> {
        let (colour, _, dashes) = signs(self.number, style);
        let ends = self.points.iter().map(|(_, found)| found.interval.unwrap_or((found.mean, found.mean)));
        let (low, high): (Vec<f64>, Vec<f64>) = ends.unzip();
        let x: Vec<f64> = self.points.iter().map(|(x, _)| *x).collect();
        let points: Vec<(f64, f64)> = self.points.iter().map(|(x, found)| (*x, found.mean)).collect();
        let has_band = low.iter().zip(&high).any(|(low, high)| low < high);
        let line = LinePlot::new()
            .with_data(points.clone())
            .with_color(colour)
            .with_stroke_width(style.line_width)
            .with_line_style(dashes.map_or(LineStyle::Solid, LineStyle::Custom));
        let mut plots = Vec::new();
        if let (true, [(x, _)]) = (has_band, points.as_slice()) {
            // A band needs two points. For a single point, the interval is a vertical line.
            let interval = LinePlot::new().with_data([(*x, low[0]), (*x, high[0])]).with_color(colour);
            plots.push(Plot::Line(interval.with_stroke_width(style.line_width * 0.6)));
        } else if has_band {
            plots.push(Plot::Band(BandPlot::new(x, low, high).with_color(colour).with_opacity(0.15)));
        }
        plots.push(Plot::Line(line));
        // A line with a single point is invisible, so it has a marker.
        if style.has_markers || points.len() == 1 {
            plots.extend(dots(&points, self.number, style));
        }
        plots
    }

    /// Returns the legend entry for the line with the given index.
    pub fn entry(number: usize, label: String, style: &Style) -> Entry {
        let point = |x| (x, Estimate { mean: 0.5, interval: None, count: 1 });
        let mut symbol = Self { number, points: vec![point(0.0), point(1.0)] }
            .plots(&Style { has_markers: false, ..style.clone() });
        if style.has_markers {
            symbol.extend(Self { number, points: vec![point(0.5)] }.plots(style));
        }
        Entry { label, symbol }
    }
}

/// Returns the markers at points of the line with the given index. Lines cycle through the shapes; in every second
/// cycle, the markers have a white dot.
pub(super) fn dots(points: &[(f64, f64)], number: usize, style: &Style) -> Vec<Plot> {
    let (colour, marker, _) = signs(number, style);
    let of = |colour: &str, share: f64| {
        let dots = ScatterPlot::new().with_data(points.to_vec()).with_color(colour);
        dots.with_size(style.line_width * 1.6 * share)
    };
    let mut plots = vec![Plot::Scatter(of(colour, 1.0).with_marker(marker))];
    if (number / MARKERS.len()) % 2 == 1 {
        plots.push(Plot::Scatter(of("#FFFFFF", 0.5)));
    }
    plots
}

/// Returns colour, marker and dash pattern of the line with the given index.
pub(super) fn signs(number: usize, style: &Style) -> (&str, MarkerShape, Option<String>) {
    let dashes = DASHES[number % DASHES.len()];
    let dashes = (style.has_line_types && !dashes.is_empty()).then(|| dashes.to_owned());
    (style.colour(number), MARKERS[number % MARKERS.len()], dashes)
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::tree::Node;
    use crate::views::options::Options;

    #[test]
    fn lines_differ_without_colours() {
        let node = Node::parse("type: plot").unwrap();
        let style = Style::read(&Options::new("Plot1", &node, &[]).unwrap(), (1.0, 1.0)).unwrap();
        let symbol = |number| {
            let (_, marker, dashes) = signs(number, &style);
            (format!("{marker:?}"), dashes)
        };
        // The markers of the ninth to the sixteenth line have a white dot.
        let layers = |number| dots(&[(0.0, 0.0)], number, &style).len();
        assert_eq!((layers(7), layers(8), layers(15), layers(16)), (1, 2, 2, 1));
        // The periods of markers and dash patterns are coprime.
        let count = DASHES.len() * MARKERS.len();
        assert_eq!((0..count).map(symbol).collect::<HashSet<_>>().len(), count);
    }
}
