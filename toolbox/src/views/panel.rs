//! Draws one plot with its axes, and places its legend.

use kuva::render::layout::ComputedLayout;
use kuva::render::plots::Plot;
use kuva::render::render::{Scene, render_multiple};

use super::axes::Frame;
use super::legend::Legend;

/// Space around a legend. Units: points.
const GAP: f64 = 4.0;

/// Preferred places of a legend, first choice first.
const CORNERS: [&str; 7] =
    ["upper right", "upper left", "lower left", "lower right", "center right", "center left", "lower center"];

/// Draws plots in a frame.
pub(super) fn framed(plots: Vec<Plot>, frame: &Frame) -> Scene {
    let mut scene = render_multiple(plots, frame.layout());
    frame.draw(&mut scene);
    scene
}

/// Draws a legend at the requested place.
///
/// Without a request, or with `best`, draws it where it covers no line; if there is no such place, next to the plot.
pub(super) fn place_legend(
    mut scene: Scene,
    frame: &Frame,
    legend: Legend,
    place: Option<&str>,
    lines: &[Vec<(f64, f64)>],
) -> Scene {
    let computed = ComputedLayout::from_layout(&frame.layout());
    let room = Room::of(&computed, legend.size());
    if let Some(place) = place.filter(|&place| place != "best") {
        legend.draw(&mut scene, room.at(place), true);
        return scene;
    }
    let on_page = |line: &Vec<(f64, f64)>| -> Vec<(f64, f64)> {
        line.iter().map(|&(x, y)| (computed.map_x(x), computed.map_y(y))).collect()
    };
    let lines: Vec<Vec<(f64, f64)>> = lines.iter().map(on_page).collect();
    if let Some(corner) = CORNERS.map(|place| room.at(place)).into_iter().find(|&at| room.is_free(at, &lines))
    {
        legend.draw(&mut scene, corner, true);
        return scene;
    }
    let (width, height) = room.size;
    let beside = (scene.width + GAP, computed.margin_top);
    scene.width += width + 3.0 * GAP;
    scene.height = scene.height.max(computed.margin_top + height + GAP);
    legend.draw(&mut scene, beside, false);
    scene
}

/// The range of positions of a legend's upper left corner within a plot.
struct Room {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    /// Width and height of the legend.
    size: (f64, f64),
}

impl Room {
    fn of(computed: &ComputedLayout, (width, height): (f64, f64)) -> Self {
        Self {
            left: computed.margin_left + GAP,
            right: computed.width - computed.margin_right - GAP - width,
            top: computed.margin_top + GAP,
            bottom: computed.height - computed.margin_bottom - GAP - height,
            size: (width, height),
        }
    }

    fn at(&self, place: &str) -> (f64, f64) {
        let (middle, centre) = (f64::midpoint(self.left, self.right), f64::midpoint(self.top, self.bottom));
        let x = match place {
            place if place.ends_with("left") => self.left,
            place if place.ends_with("right") => self.right,
            _ => middle,
        };
        let y = match place {
            place if place.starts_with("upper") => self.top,
            place if place.starts_with("lower") => self.bottom,
            _ => centre,
        };
        (x, y)
    }

    /// Returns whether a legend is within the plot and away from its lines.
    fn is_free(&self, (x, y): (f64, f64), lines: &[Vec<(f64, f64)>]) -> bool {
        let is_inside = self.left <= self.right && self.top <= self.bottom;
        let size = (self.size.0 + 2.0 * GAP, self.size.1 + 2.0 * GAP);
        is_inside && !lines.iter().any(|line| crosses(line, (x - GAP, y - GAP), size))
    }
}

/// Returns whether a line enters a rectangle, tested at closely spaced points.
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
