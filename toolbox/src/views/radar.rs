//! The six metrics of each algorithm, as a table and as a radar plot.

use std::f64::consts::TAU;

use kuva::plot::line::LinePlot;
use kuva::render::plots::Plot;
use kuva::render::render::{Scene, TextAnchor};
use pogema_core::{Error, Words};

use super::Shown;
use super::axes::{anchored, text, text_width};
use super::compose::{bare, insert, plain_layout};
use super::legend::Legend;
use super::options::{Common, Options};
use super::page::single;
use super::picture::Picture;
use super::series::Series;
use super::style::{COLUMN, Style};
use super::table::{Cell, Table};
use crate::bootstrap::Estimate;
use crate::results::{ALGORITHM, Results};
use crate::six::{Definition, Metric, Six, six};
use crate::tree::Node;

/// The values at which there is a ring.
const RINGS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// `type: radar`: the six metrics. They need the folders of a whole evaluation.
///
/// `definition` is `published` or `paper` [default: `published`].
#[derive(Clone, Debug)]
pub struct RadarView {
    common: Common,
    style: Style,
    definition: Definition,
}

impl RadarView {
    pub(super) fn read(name: &str, node: &Node) -> Result<Self, Error> {
        let options = Options::new(name, node, &Style::keys(&["definition"]))?;
        Ok(Self {
            common: Common::read(&options)?,
            style: Style::read(&options, COLUMN)?,
            definition: options.word("definition")?.unwrap_or_default(),
        })
    }

    /// Computes and draws the metrics; if `definition` is given, it overrides the view's own.
    ///
    /// # Errors
    /// If no metric can be computed for any algorithm.
    pub(super) fn show(
        &self,
        name: &str,
        results: &Results,
        definition: Option<Definition>,
    ) -> Result<Shown, Error> {
        let definition = definition.unwrap_or(self.definition);
        let (all, mut notes) = six(results, definition);
        if all.iter().all(|six| six.values.iter().all(Option::is_none)) {
            let reason =
                format!("view `{name}`: none of the six metrics can be computed: {}", notes.join("; "));
            return Err(Error::request(reason));
        }
        let is_known = |at: &usize| all.iter().any(|six| six.values[*at].is_some());
        let known: Vec<usize> = (0..Metric::NAMES.len()).filter(is_known).collect();
        let pictures = if known.len() < 3 {
            notes
                .push(format!("view `{name}`: a radar plot needs at least 3 metrics, found {}", known.len()));
            Vec::new()
        } else {
            let is_beyond = |six: &Six| six.values.iter().flatten().any(|&value| value > 1.0);
            if all.iter().any(is_beyond) {
                notes.push("values above 1 are drawn as 1".to_owned());
            }
            vec![self.draw(&all, &known)]
        };
        Ok(Shown { tables: vec![self.table(&all, definition)], pictures, notes })
    }

    fn table(&self, all: &[Six], definition: Definition) -> Table {
        let title = Metric::NAMES.iter().map(|metric| self.common.title(metric));
        let row = |six: &Six| {
            let name = Cell::Text(self.common.algorithm(&six.algorithm));
            std::iter::once(name).chain(six.values.map(Cell::Number)).collect()
        };
        let definition = match definition {
            Definition::Published => "the six metrics as published",
            Definition::Paper => "the six metrics as defined in the paper's text",
        };
        Table {
            head: std::iter::once(self.common.title(ALGORITHM)).chain(title).collect(),
            rows: all.iter().map(row).collect(),
            digits: self.common.digits,
            remark: Some(definition.to_owned()),
            ..Table::default()
        }
    }

    fn draw(&self, all: &[Six], known: &[usize]) -> Picture {
        let names: Vec<String> = known.iter().map(|&at| self.common.title(Metric::NAMES[at])).collect();
        let of = |(number, six): (usize, &Six)| {
            let values: Vec<Option<f64>> =
                known.iter().map(|&at| six.values[at].map(|value| value.min(1.0))).collect();
            let estimate = |(x, mean)| (x, Estimate { mean, interval: None, count: 1 });
            let series = move |points: Vec<(f64, f64)>| Series {
                number,
                points: points.into_iter().map(estimate).collect(),
            };
            runs(&values).into_iter().map(series)
        };
        let lines: Vec<Series> = all.iter().enumerate().flat_map(of).collect();
        let entries = all
            .iter()
            .enumerate()
            .map(|(number, six)| Series::entry(number, self.common.algorithm(&six.algorithm), &self.style));
        let legend = Legend {
            title: None,
            entries: entries.collect(),
            columns: self.style.legend_columns,
            font_size: self.style.legend_font_size,
        };
        // A legend within the plot would cover a metric.
        let style = Style { legend_place: None, ..self.style.clone() };
        let scene = single(&style, legend, |style| (web(style, &names, &lines), None));
        Picture::new(scene, &self.style)
    }
}

/// Returns the place of a value on one of several spokes; the first points up, the others follow clockwise.
fn polar(spoke: usize, spokes: usize, value: f64) -> (f64, f64) {
    let angle = TAU * spoke as f64 / spokes as f64;
    (value * angle.sin(), value * angle.cos())
}

/// Returns the lines through the known values.
///
/// If values are missing, returns one line per run between gaps; otherwise, one closed line.
fn runs(values: &[Option<f64>]) -> Vec<Vec<(f64, f64)>> {
    let count = values.len();
    let point = |spoke: usize| Some(polar(spoke, count, values[spoke]?));
    let Some(gap) = values.iter().position(Option::is_none) else {
        return vec![closed((0..count).filter_map(point).collect())];
    };
    let around: Vec<_> = (gap..gap + count).map(|spoke| point(spoke % count)).collect();
    let known = around.split(Option::is_none).filter(|run| !run.is_empty());
    known.map(|run| run.iter().flatten().copied().collect()).collect()
}

fn closed(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.extend(points.first().copied());
    points
}

/// Draws the lines on rings and spokes, with names around them.
fn web(style: &Style, names: &[String], lines: &[Series]) -> Scene {
    let (size, small, count) = (f64::from(style.font_size), style.legend_font_size, names.len());
    let heading = style.title().map_or(0.0, |_| size * 1.6);
    let labels: Vec<Vec<&str>> = names.iter().map(|name| in_two(name)).collect();
    let widest = labels.iter().flatten().map(|text| text_width(text, style.font_size)).fold(0.0, f64::max);
    let radius =
        ((style.height - heading) / 2.0 - size * 1.9).min(style.width / 2.0 - widest - size).max(size);
    let (x, y) = (style.width / 2.0, heading + (style.height - heading) / 2.0);
    let grid = |points: Vec<(f64, f64)>| {
        Plot::Line(LinePlot::new().with_data(points).with_color("#CCCCCC").with_stroke_width(0.5))
    };
    let ring = |value: f64| grid(closed((0..count).map(|spoke| polar(spoke, count, value)).collect()));
    let mut plots: Vec<Plot> = RINGS.map(ring).into();
    plots.extend((0..count).map(|spoke| grid(vec![(0.0, 0.0), polar(spoke, count, 1.0)])));
    plots.extend(lines.iter().flat_map(|line| line.plots(style)));
    let reach = 1.0 + size * 0.5 / radius;
    let layout = plain_layout((2.0 * radius * reach, 2.0 * radius * reach), (-reach, reach), (-reach, reach));
    let mut scene = Scene::new(style.width, style.height);
    insert(&mut scene, bare(plots, layout), (x - radius * reach, y - radius * reach));
    for (spoke, lines) in labels.iter().enumerate() {
        let (across, up) = polar(spoke, count, 1.0);
        let anchor = match across {
            east if east > 0.1 => TextAnchor::Start,
            west if west < -0.1 => TextAnchor::End,
            _ => TextAnchor::Middle,
        };
        let left = x + across * (radius + size * 0.7);
        let above = y - up * (radius + size * 0.9) + size * (0.35 - (lines.len() - 1) as f64 / 2.0 * 1.1);
        for (number, line) in lines.iter().enumerate() {
            scene.add(anchored(
                line,
                (left, above + number as f64 * size * 1.1),
                style.font_size,
                anchor,
                None,
            ));
        }
    }
    for value in RINGS {
        let place = (x + 2.0, y - value * radius + f64::from(small) * 0.9);
        scene.add(anchored(&value.to_string(), place, small, TextAnchor::Start, None));
    }
    if let Some(title) = style.title() {
        scene.add(text(title, (style.width / 2.0, size * 1.2), style.font_size));
    }
    scene
}

/// Breaks a long name after its last hyphen or space.
fn in_two(name: &str) -> Vec<&str> {
    match name.rfind(['-', ' ']).filter(|_| name.chars().count() > 12) {
        Some(end) => vec![&name[..=end], &name[end + 1..]],
        None => vec![name],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_value_opens_the_line() {
        let lengths = |values: &[Option<f64>]| runs(values).iter().map(Vec::len).collect::<Vec<_>>();
        let known = Some(0.5);
        assert_eq!(lengths(&[known; 4]), [5]);
        assert_eq!(lengths(&[known, known, None, known]), [3]);
        assert_eq!(lengths(&[known, None, known, None]), [1, 1]);
        assert!(lengths(&[None; 3]).is_empty());
        assert_eq!(runs(&[known, known, None, known])[0][0], polar(3, 4, 0.5));
    }
}
