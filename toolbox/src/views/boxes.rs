//! Box plots: the distribution of a metric in each group of rows.

use kuva::plot::boxplot::BoxPlot;
use kuva::plot::scatter::ScatterPlot;
use kuva::render::plots::Plot;
use pogema_core::Error;
use serde_json::Value;

use super::axes::{Axis, linear_note};
use super::options::{Common, Options};
use super::page::framed;
use super::picture::Picture;
use super::series::{distinct, has, placeless};
use super::style::{COLUMN, Style};
use super::{Shown, known_column, known_metric};
use crate::bootstrap::percentile;
use crate::groups::{lacking, values};
use crate::results::{ALGORITHM, Results, Row};
use crate::tree::Node;

/// `type: box`: a box of the metric `y` for each value of the column `x` [default: `algorithm`].
///
/// A box spans the interquartile range (IQR) of the values and shows their median. Its whiskers end at the outermost
/// values within 1.5 IQR of the box. Values beyond the whiskers are dots.
#[derive(Clone, Debug)]
pub struct BoxView {
    common: Common,
    style: Style,
    x: String,
    y: String,
}

impl BoxView {
    pub(super) fn read(name: &str, node: &Node) -> Result<Self, Error> {
        let options = Options::new(name, node, &Style::keys(&[]))?;
        Ok(Self {
            common: Common::read(&options)?,
            style: Style::read(&options, COLUMN)?,
            x: options.text("x")?.unwrap_or_else(|| ALGORITHM.to_owned()),
            y: options.required("y")?,
        })
    }

    /// Draws the plot.
    ///
    /// # Errors
    /// If the results lack a column, or no row has a number in `y`.
    pub(super) fn show(&self, name: &str, results: &Results) -> Result<Shown, Error> {
        known_column(name, "x", &self.x, results)?;
        known_metric(name, "y", &self.y, results)?;
        let keys = distinct(&results.rows, &self.x);
        let group = |key: &Value| {
            let rows: Vec<&Row> = results.rows.iter().filter(|row| has(row, &self.x, key)).collect();
            (self.common.shown(&self.x, key), values(&rows, &self.y))
        };
        // Groups are drawn from bottom to top, so the order is reversed.
        let groups: Vec<(String, Vec<f64>)> =
            keys.iter().rev().map(group).filter(|(_, values)| !values.is_empty()).collect();
        if groups.is_empty() {
            return Err(Error::request(format!("view `{name}`: no row has a number in `{}`", self.y)));
        }
        let mut notes = placeless(&results.rows, [&self.x]);
        notes.extend(lacking(&results.rows, std::slice::from_ref(&self.y)));
        let values = groups.iter().flat_map(|(_, values)| values).copied();
        notes.extend(linear_note(name, self.style.log_y, values));
        Ok(Shown { pictures: vec![self.draw(groups)], notes, ..Shown::default() })
    }

    fn draw(&self, groups: Vec<(String, Vec<f64>)>) -> Picture {
        let all: Vec<f64> = groups.iter().flat_map(|(_, values)| values).copied().collect();
        let is_log = self.style.log_y && all.iter().all(|&value| value > 0.0);
        let names: Vec<String> = groups.iter().map(|(name, _)| name.clone()).collect();
        let mut dots: Vec<(f64, f64)> = Vec::new();
        for (number, (_, values)) in groups.iter().enumerate() {
            dots.extend(outliers(values).into_iter().map(|x| (x, number as f64 + 1.0)));
        }
        let mut boxes = BoxPlot::new().with_horizontal(true).with_width(0.6).with_color(self.style.colour(0));
        for (name, values) in groups {
            boxes = boxes.with_group(name, values);
        }
        let mut plots = vec![Plot::Box(boxes)];
        if !dots.is_empty() {
            let dots = ScatterPlot::new().with_data(dots).with_color("#555555").with_size(1.0);
            plots.push(Plot::Scatter(dots.with_marker_opacity(0.5)));
        }
        let x = Axis::of_numbers(&self.common.title(&self.y), &all, is_log, self.style.ticks.as_deref());
        let y = Axis::of_names(&self.common.title(&self.x), &names, 1.0);
        Picture::new(framed(plots, &self.style.frame(x, y)), &self.style)
    }
}

/// Returns the values more than 1.5 IQR outside the box.
fn outliers(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (percentile(&sorted, 25.0), percentile(&sorted, 75.0));
    let reach = 1.5 * (high - low);
    sorted.retain(|&value| value < low - reach || value > high + reach);
    sorted
}
