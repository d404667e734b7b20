//! Axes with ticks at chosen values. The plotting library cannot place ticks freely.

use std::sync::LazyLock;

use kuva::render::layout::Layout;
use kuva::render::render::{Primitive, Scene, TextAnchor};
use ttf_parser::Face;

use super::compose::plain_layout;

/// Colour of the grid lines behind a plot.
const GRID: &str = "#DDDDDD";

/// The largest number of ticks on a logarithmic axis that also has ticks at 2 and 5 times the powers of ten.
const MAX_LOG_TICKS: usize = 9;
/// Share of the range of values that an axis leaves free at each end.
const MARGIN: f64 = 0.05;

/// Exponent of the smallest power of two on a logarithmic axis, as in the library.
const LEAST: f64 = -33.0;

/// Length of a tick. Units: points.
const TICK: f64 = 3.0;

/// Angle of slanted labels. Units: degrees.
const SLANT: f64 = 40.0;

/// Returns the note of a view in which an axis is linear although a logarithmic one was requested.
pub(super) fn linear_note(
    view: &str,
    is_requested: bool,
    mut values: impl Iterator<Item = f64>,
) -> Option<String> {
    let is_linear = is_requested && values.any(|value| value <= 0.0);
    is_linear.then(|| format!("view `{view}`: an axis with values of 0 or less is linear, not logarithmic"))
}

/// One axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axis {
    pub title: String,
    pub is_log: bool,
    /// Whether the ticks are names, none of which may be left out.
    pub has_names: bool,
    /// The lower and the upper end.
    pub range: (f64, f64),
    /// Positions and labels of the ticks.
    pub ticks: Vec<(f64, String)>,
}

impl Axis {
    /// Creates an axis for numbers, with the given ticks or round ones. Without values and ticks, a linear axis spans 0
    /// to 1.
    pub fn of_numbers(title: &str, values: &[f64], is_log: bool, ticks: Option<&[f64]>) -> Self {
        let may_be_shown = |tick: &&f64| !is_log || **tick > 0.0;
        let ticks: Option<Vec<f64>> = ticks.map(|ticks| ticks.iter().filter(may_be_shown).copied().collect());
        let shown = |value: f64| if is_log { value.max(f64::MIN_POSITIVE).log2() } else { value };
        let all = values.iter().chain(ticks.iter().flatten()).map(|&value| shown(value));
        let (low, high) = all
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let margin = match high - low {
            length if length > 0.0 => length * MARGIN,
            _ if is_log => 0.5,
            _ => low.abs().max(1.0) / 2.0,
        };
        let (low, high) = (low - margin, high + margin);
        let range = if is_log { (low.max(LEAST).exp2(), high.max(LEAST + 1.0).exp2()) } else { (low, high) };
        let ticks = match ticks {
            Some(ticks) => ticks.into_iter().map(|tick| (tick, number(tick))).collect(),
            None if is_log => powers(range),
            None => round_numbers(range),
        };
        Self { title: title.to_owned(), is_log, has_names: false, range, ticks }
    }

    /// Creates an axis for names at consecutive positions, starting with `first`.
    pub fn of_names(title: &str, names: &[String], first: f64) -> Self {
        let ticks =
            names.iter().enumerate().map(|(place, name)| (first + place as f64, name.clone())).collect();
        let range = (first - 0.5, first + names.len() as f64 - 0.5);
        Self { title: title.to_owned(), is_log: false, has_names: true, range, ticks }
    }

    /// Returns the place of a value as a share of the axis.
    fn share(&self, value: f64) -> f64 {
        let place = |value: f64| if self.is_log { value.log10() } else { value };
        let (low, high) = (place(self.range.0), place(self.range.1));
        (place(value) - low) / (high - low)
    }
}

/// Formats a number for a tick, with commas between groups of three digits.
fn number(value: f64) -> String {
    let is_small = value != 0.0 && value.abs() < 1e-3;
    if is_small || value.abs() >= 1e7 {
        // Products such as 3 x 2e-4 are not exact.
        let rounded = format!("{value:.9e}").parse().unwrap_or(value);
        return format!("{rounded:e}");
    }
    let text = ((value * 1e9).round() / 1e9).to_string();
    let start = usize::from(value < 0.0);
    let end = text.find('.').unwrap_or(text.len());
    let mut grouped = text.clone();
    for place in (start + 1..end).rev().filter(|place| (end - place).is_multiple_of(3)) {
        grouped.insert(place, ',');
    }
    grouped
}

/// Returns about five round numbers within a range, with their labels.
fn round_numbers((low, high): (f64, f64)) -> Vec<(f64, String)> {
    let rough = (high - low) / 5.0;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 2.5, 5.0, 10.0].map(|factor| factor * power);
    let step = step.into_iter().find(|&step| step >= rough).unwrap_or(power * 10.0);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last).map(|count| count as f64 * step).map(|tick| (tick, number(tick))).collect()
}

/// Returns the powers of ten, and 2 and 5 times these powers, within a range above zero, with their labels.
///
/// In a wide range, returns only the powers of ten; in a narrow one, round numbers.
fn powers((low, high): (f64, f64)) -> Vec<(f64, String)> {
    let of = |factors: &[f64]| -> Vec<(f64, String)> {
        let counts = low.log10().floor() as i32..=high.log10().ceil() as i32;
        let all = counts.flat_map(|count| factors.iter().map(move |factor| factor * 10f64.powi(count)));
        all.filter(|tick| (low..=high).contains(tick)).map(|tick| (tick, number(tick))).collect()
    };
    let ticks = of(&[1.0, 2.0, 5.0]);
    match ticks.len() {
        0..3 => round_numbers((low, high)),
        3..=MAX_LOG_TICKS => ticks,
        _ => of(&[1.0]),
    }
}

/// Returns the width of a text in the font of plots.
pub(super) fn text_width(text: &str, size: u32) -> f64 {
    static FACE: LazyLock<Option<Face<'static>>> =
        LazyLock::new(|| Face::parse(dejavu::sans::regular(), 0).ok());
    let advance = |letter: char| {
        let face = FACE.as_ref()?;
        let advance = face.glyph_hor_advance(face.glyph_index(letter)?)?;
        Some(f64::from(advance) / f64::from(face.units_per_em()))
    };
    // Characters of other fonts, such as Chinese ones, are at most about as wide as high.
    text.chars().map(|letter| advance(letter).unwrap_or(1.0)).sum::<f64>() * f64::from(size)
}

/// How the labels of the horizontal axis are drawn.
struct Labels {
    is_slanted: bool,
    /// Whether each tick within the range has a label.
    are_shown: Vec<bool>,
}

/// The frame of one plot: its size, title and axes.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub width: f64,
    pub height: f64,
    pub font_size: u32,
    pub title: Option<String>,
    /// Whether both axes have the same length.
    pub is_square: bool,
    pub x: Axis,
    pub y: Axis,
}

impl Frame {
    fn width_of(&self, text: &str) -> f64 {
        text_width(text, self.font_size)
    }

    fn widest(&self, axis: &Axis) -> f64 {
        within(axis).map(|(_, text)| self.width_of(text)).fold(0.0, f64::max)
    }

    /// Returns the left, upper, right and lower ends of the axes.
    pub fn inner(&self) -> [f64; 4] {
        let size = f64::from(self.font_size);
        let labels =
            if self.labels().is_slanted { self.widest(&self.x) * SLANT.to_radians().sin() } else { 0.0 };
        let top = self.title.as_ref().map_or(size * 0.6, |_| size * 2.0);
        let bottom = (self.height - (TICK + size * 2.9 + labels)).max(top + size);
        let (left, right) = self.sides();
        let spare = if self.is_square { ((right - left) - (bottom - top)).max(0.0) / 2.0 } else { 0.0 };
        [left + spare, top, right - spare, bottom]
    }

    fn sides(&self) -> (f64, f64) {
        let size = f64::from(self.font_size);
        let left = (size * 2.0 + self.widest(&self.y) + TICK).min(self.width * 0.45);
        let last = self.x.ticks.last().map_or(0.0, |(_, text)| self.width_of(text) / 2.0);
        (left, self.width - (size * 0.6 + last.min(size * 1.5)))
    }

    /// Slants the labels of the horizontal axis if they do not fit side by side. Numbers that do not fit even if
    /// slanted stay level. Where necessary, numbers between the first and the last are left out.
    fn labels(&self) -> Labels {
        let (left, right) = self.sides();
        let size = f64::from(self.font_size);
        let spots: Vec<(f64, f64)> = within(&self.x)
            .map(|(tick, text)| (left + (right - left) * self.x.share(tick), self.width_of(text) / 2.0))
            .collect();
        let neighbours = || spots.iter().zip(spots.iter().skip(1));
        let are_apart = |one: (f64, f64), next: (f64, f64)| one.0 + one.1 + size * 0.25 <= next.0 - next.1;
        let has_room = neighbours().all(|(&one, &next)| are_apart(one, next));
        let has_room_slanted =
            neighbours().all(|(one, next)| (next.0 - one.0) * SLANT.to_radians().sin() >= size);
        let mut are_shown = vec![true; spots.len()];
        if has_room || has_room_slanted || self.x.has_names {
            return Labels { is_slanted: !has_room, are_shown };
        }
        let mut next = spots.len() - 1;
        for place in (1..next).rev() {
            are_shown[place] = are_apart(spots[place], spots[next]) && are_apart(spots[0], spots[place]);
            if are_shown[place] {
                next = place;
            }
        }
        Labels { is_slanted: false, are_shown }
    }

    /// Returns the layout for the plotting library, with only the lines of the axes.
    pub fn layout(&self) -> Layout {
        let [left, top, right, bottom] = self.inner();
        let mut layout = plain_layout((self.width, self.height), self.x.range, self.y.range)
            .with_force_margins(left, self.width - right)
            .with_force_margins_y(top, self.height - bottom)
            .with_axis_line_width(0.6);
        (layout.log_x, layout.log_y) = (self.x.is_log, self.y.is_log);
        layout
    }

    /// Draws grid lines behind the plot, and ticks and texts around it.
    pub fn draw(&self, scene: &mut Scene) {
        let [left, top, right, bottom] = self.inner();
        let size = f64::from(self.font_size);
        let mut behind = Vec::new();
        let Labels { is_slanted, are_shown } = self.labels();
        for ((tick, text), is_shown) in within(&self.x).zip(are_shown) {
            let x = left + (right - left) * self.x.share(tick);
            behind.push(line((x, top), (x, bottom), GRID));
            scene.add(line((x, bottom), (x, bottom + TICK), "black"));
            if !is_shown {
                continue;
            }
            let label = if is_slanted {
                let place = (x + size * 0.3, bottom + TICK + size * 0.8);
                anchored(text, place, self.font_size, TextAnchor::End, Some(-SLANT))
            } else {
                self::text(text, (x, bottom + TICK + size), self.font_size)
            };
            scene.add(label);
        }
        for (tick, text) in within(&self.y) {
            let y = bottom - (bottom - top) * self.y.share(tick);
            behind.push(line((left, y), (right, y), GRID));
            scene.add(line((left - TICK, y), (left, y), "black"));
            let place = (left - TICK - 2.0, y + size * 0.35);
            scene.add(anchored(text, place, self.font_size, TextAnchor::End, None));
        }
        scene.elements.splice(0..0, behind);
        let (middle_x, middle_y) = (f64::midpoint(left, right), f64::midpoint(top, bottom));
        scene.add(text(&self.x.title, (middle_x, self.height - size * 0.5), self.font_size));
        let beside = (left - TICK - 2.0 - self.widest(&self.y) - size * 0.6, middle_y);
        scene.add(anchored(&self.y.title, beside, self.font_size, TextAnchor::Middle, Some(-90.0)));
        if let Some(title) = &self.title {
            scene.add(text(title, (middle_x, top - size * 0.6), self.font_size));
        }
    }
}

/// Returns a text centred at a position.
pub(super) fn text(text: &str, place: (f64, f64), size: u32) -> Primitive {
    anchored(text, place, size, TextAnchor::Middle, None)
}

/// Returns a text that starts, is centred or ends at a position, rotated by some degrees.
pub(super) fn anchored(
    text: &str,
    (x, y): (f64, f64),
    size: u32,
    anchor: TextAnchor,
    rotate: Option<f64>,
) -> Primitive {
    Primitive::Text { x, y, content: text.to_owned(), size, anchor, rotate, bold: false, color: None }
}

/// Returns the ticks within the range of the axis.
fn within(axis: &Axis) -> impl Iterator<Item = (f64, &String)> {
    let (low, high) = axis.range;
    axis.ticks.iter().map(|(tick, text)| (*tick, text)).filter(move |&(tick, _)| low <= tick && tick <= high)
}

fn line((x1, y1): (f64, f64), (x2, y2): (f64, f64), colour: &str) -> Primitive {
    Primitive::Line { x1, y1, x2, y2, stroke: colour.into(), stroke_width: 0.5, stroke_dasharray: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within_the_range() {
        let texts = |axis: Axis| axis.ticks.into_iter().map(|(_, text)| text).collect::<Vec<_>>();
        assert_eq!(texts(Axis::of_numbers("", &[0.0, 1.0], false, None)), ["0", "0.25", "0.5", "0.75", "1"]);
        assert_eq!(texts(Axis::of_numbers("", &[3.0, 1210.0], false, None)), ["0", "500", "1,000"]);
        assert_eq!(texts(Axis::of_numbers("", &[8.0, 64.0], true, None)), ["10", "20", "50"]);
        assert_eq!(
            texts(Axis::of_numbers("", &[130.0, 8100.0], true, None)),
            ["200", "500", "1,000", "2,000", "5,000"]
        );
        assert_eq!(
            texts(Axis::of_numbers("", &[118.0, 8190.0], true, None)),
            ["100", "200", "500", "1,000", "2,000", "5,000", "10,000"]
        );
        assert_eq!(texts(Axis::of_numbers("", &[610.0, 680.0], true, None)), ["620", "640", "660", "680"]);
        assert_eq!(
            texts(Axis::of_numbers("", &[-2e4, 2e4], false, None)),
            ["-20,000", "-10,000", "0", "10,000", "20,000"]
        );
        assert_eq!(
            texts(Axis::of_numbers("", &[0.01, 900.0], true, None)),
            ["0.01", "0.1", "1", "10", "100", "1,000"]
        );
        assert_eq!(
            texts(Axis::of_numbers("", &[6e-5, 0.003], true, None)),
            ["5e-5", "1e-4", "2e-4", "5e-4", "0.001", "0.002"]
        );
        assert_eq!(
            texts(Axis::of_numbers("", &[1e6, 6e6], false, None)),
            ["2,000,000", "4,000,000", "6,000,000"]
        );
        assert_eq!(
            texts(Axis::of_numbers("", &[0.0, 9e-4], false, None)),
            ["0", "2e-4", "4e-4", "6e-4", "8e-4"]
        );
        assert_eq!(number(-1_234_567.25), "-1,234,567.25");
        assert_eq!(texts(Axis::of_numbers("", &[], false, None)), ["0", "0.25", "0.5", "0.75", "1"]);
        assert_eq!(texts(Axis::of_numbers("", &[2.0, 8.0], true, Some(&[0.0, 4.0]))), ["4"]);
        assert_eq!(texts(Axis::of_numbers("", &[5.0], false, Some(&[5.0]))), ["5"]);
    }
}
