//! Arranges the panels of a plot and its legend on one page.

use kuva::render::plots::Plot;
use kuva::render::render::{Scene, render_multiple};

use super::axes::{Frame, text};
use super::compose::insert;
use super::legend::Legend;
use super::style::Style;

/// Space around a legend within a plot. Units: points.
const GAP: f64 = 4.0;

/// Draws plots in a frame.
pub(super) fn framed(plots: Vec<Plot>, frame: &Frame) -> Scene {
    let mut scene = render_multiple(plots, frame.layout());
    frame.draw(&mut scene);
    scene
}

/// Draws a single panel and its legend in the size of the style. If a legend below the plot needs more than a third of
/// the height, the page is higher.
///
/// The legend is at the requested place within the plot. Without a request, or with `best`, it is below the plot, where
/// it covers nothing. `draw` draws the panel in the size of the given style.
pub(super) fn single(
    style: &Style,
    mut legend: Legend,
    draw: impl FnOnce(&Style) -> (Scene, Option<Frame>),
) -> Scene {
    let place = style.legend_place.filter(|&place| place != "best");
    if place.is_some() {
        legend.columns = 1;
    } else {
        legend.fit(style.width);
    }
    let (width, height) = legend.size();
    let room = if place.is_some() { 0.0 } else { height.min(style.height / 3.0) };
    let (mut scene, frame) = draw(&Style { height: style.height - room, ..style.clone() });
    if let (Some(place), Some(frame)) = (place, frame) {
        legend.draw(&mut scene, within(&frame, (width, height), place), true);
    } else {
        let (top, total) = (scene.height, style.width.max(width));
        (scene.width, scene.height) = (total, top + height);
        legend.draw(&mut scene, ((total - width) / 2.0, top), false);
    }
    scene
}

/// Arranges panels in a grid, with the title above.
///
/// If `legend_loc` is at the top, the legend is above the panels, otherwise below.
pub(super) fn grid(style: &Style, parts: Vec<Scene>, columns: usize, mut legend: Legend) -> Scene {
    let columns = columns.min(parts.len()).max(1);
    let total = style.width * columns as f64;
    legend.fit(total);
    let (width, height) = legend.size();
    let is_above = style.legend_place.is_some_and(|place| place.starts_with("upper"));
    let heading = style.title().map_or(0.0, |_| f64::from(style.font_size) * 2.0);
    let first = heading + if is_above { height } else { 0.0 };
    let panels = style.height * parts.len().div_ceil(columns) as f64;
    let total = total.max(width);
    let mut scene = Scene::new(total, heading + panels + height);
    for (number, part) in parts.into_iter().enumerate() {
        let (row, column) = (number / columns, number % columns);
        insert(&mut scene, part, (column as f64 * style.width, first + row as f64 * style.height));
    }
    if let Some(title) = style.title() {
        scene.add(text(title, (total / 2.0, heading * 0.7), style.font_size + 1));
    }
    let top = if is_above { heading } else { first + panels };
    legend.draw(&mut scene, ((total - width) / 2.0, top), false);
    scene
}

/// Returns the upper left corner of a legend at a place within a plot.
fn within(frame: &Frame, (width, height): (f64, f64), place: &str) -> (f64, f64) {
    let [left, top, right, bottom] = frame.inner();
    let at = |low: f64, high: f64, is_low: bool, is_high: bool| match (is_low, is_high) {
        (true, _) => low,
        (_, true) => high,
        _ => f64::midpoint(low, high),
    };
    let x = at(left + GAP, right - GAP - width, place.ends_with("left"), place.ends_with("right"));
    let y = at(top + GAP, bottom - GAP - height, place.starts_with("upper"), place.starts_with("lower"));
    (x, y)
}
