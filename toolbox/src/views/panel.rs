//! One plot with its axes, and the place of its legend.

use kuva::render::layout::{ComputedLayout, Layout};
use kuva::render::plots::Plot;
use kuva::render::render::{Primitive, Scene, render_multiple};

use super::axes::Frame;
use super::legend::Legend;

/// Space between a legend and what is around it. Units: points.
const GAP: f64 = 4.0;

/// Draws plots without their axes.
pub(super) fn bare(plots: Vec<Plot>, layout: Layout) -> Scene {
    let mut scene = render_multiple(plots, layout);
    // The axes come first, and then what is cut off at them.
    let first = scene.elements.iter().position(|element| matches!(element, Primitive::ClipStart { .. }));
    scene.elements.drain(..first.unwrap_or(0));
    scene
}

/// Draws plots in a frame.
pub(super) fn framed(plots: Vec<Plot>, frame: &Frame) -> Scene {
    let mut scene = render_multiple(plots, frame.layout());
    frame.draw(&mut scene);
    scene
}

/// Puts one scene into another.
pub(super) fn insert(scene: &mut Scene, part: Scene, (x, y): (f64, f64)) {
    scene.font_family = scene.font_family.take().or(part.font_family);
    scene.defs.extend(part.defs);
    let transform = Some(format!("translate({x},{y})"));
    scene.add(Primitive::GroupStart { transform, title: None, extra_attrs: None });
    scene.elements.extend(part.elements);
    scene.add(Primitive::GroupEnd);
}

/// Draws a legend where it was asked for; if that is left to us, where no line is, or else beside the plot.
pub(super) fn place_legend(
    scene: Scene,
    frame: &Frame,
    legend: Legend,
    place: Option<&str>,
    lines: &[Vec<(f64, f64)>],
) -> Scene {
    let computed = ComputedLayout::from_layout(&frame.layout());
    let (width, height) = legend.size();
    let (left, right) = (computed.margin_left + GAP, computed.width - computed.margin_right - GAP - width);
    let (top, bottom) = (computed.margin_top + GAP, computed.height - computed.margin_bottom - GAP - height);
    let (middle, centre) = (f64::midpoint(left, right), f64::midpoint(top, bottom));
    let at = |place: &str| match place {
        "upper right" => (right, top),
        "upper left" => (left, top),
        "lower left" => (left, bottom),
        "lower right" => (right, bottom),
        "right" | "center right" => (right, centre),
        "center left" => (left, centre),
        "lower center" => (middle, bottom),
        "upper center" => (middle, top),
        _ => (middle, centre),
    };
    let mut scene = scene;
    if let Some(place) = place.filter(|&place| place != "best") {
        legend.draw(&mut scene, at(place), true);
        return scene;
    }
    let lines: Vec<Vec<(f64, f64)>> = lines
        .iter()
        .map(|line| line.iter().map(|&(x, y)| (computed.map_x(x), computed.map_y(y))).collect())
        .collect();
    let is_free = |&(x, y): &(f64, f64)| {
        let is_inside = x >= left && y >= top && x <= right + 0.1 && y <= bottom + 0.1;
        is_inside
            && !lines
                .iter()
                .any(|line| crosses(line, (x - GAP, y - GAP), (width + 2.0 * GAP, height + 2.0 * GAP)))
    };
    let places = [
        "upper right",
        "upper left",
        "lower left",
        "lower right",
        "center right",
        "center left",
        "lower center",
    ];
    if let Some(corner) = places.map(at).into_iter().find(is_free) {
        legend.draw(&mut scene, corner, true);
        return scene;
    }
    let beside = (scene.width + GAP, computed.margin_top);
    scene.width += width + 3.0 * GAP;
    scene.height = scene.height.max(computed.margin_top + height + GAP);
    legend.draw(&mut scene, beside, false);
    scene
}

/// Whether a line comes into a rectangle, as far as points close together tell.
fn crosses(line: &[(f64, f64)], (left, top): (f64, f64), (width, height): (f64, f64)) -> bool {
    let is_within = |(x, y): (f64, f64)| x >= left && x <= left + width && y >= top && y <= top + height;
    let between = |(one, other): (&(f64, f64), &(f64, f64))| {
        (0..=50).any(|step| {
            let share = f64::from(step) / 50.0;
            is_within((one.0 + (other.0 - one.0) * share, one.1 + (other.1 - one.1) * share))
        })
    };
    line.iter().any(|&point| is_within(point)) || line.iter().zip(line.iter().skip(1)).any(between)
}
