//! Cactus plots: the number of instances that each algorithm solves within a time.

use kuva::plot::line::{LinePlot, LineStyle};
use kuva::render::plots::Plot;
use pogema_core::Error;

use super::axes::{Axis, linear_note};
use super::legend::Legend;
use super::options::{Common, Options};
use super::page::{framed, single};
use super::picture::Picture;
use super::series::{Series, dots, signs};
use super::style::{COLUMN, Style};
use super::{Shown, known_metric};
use crate::groups::{lacking, values};
use crate::results::{RUNTIME, Results, SOLVED};
use crate::tree::Node;

/// `type: cactus`: for each algorithm, a line that rises by one at the `runtime` of each solved instance.
///
/// `x` may name another metric [default: `runtime`]. Its axis is logarithmic unless `use_log_scale_x` is false or a
/// value is not positive.
#[derive(Clone, Debug)]
pub struct CactusView {
    common: Common,
    style: Style,
    x: String,
}

impl CactusView {
    pub(super) fn read(name: &str, node: &Node) -> Result<Self, Error> {
        let options = Options::new(name, node, &Style::keys(&[]))?;
        let log_x = options.flag("use_log_scale_x")?.unwrap_or(true);
        Ok(Self {
            common: Common::read(&options)?,
            style: Style { log_x, ..Style::read(&options, COLUMN)? },
            x: options.text("x")?.unwrap_or_else(|| RUNTIME.to_owned()),
        })
    }

    /// Draws the plot.
    ///
    /// # Errors
    /// If the results lack a metric, or no instance was solved.
    pub(super) fn show(&self, name: &str, results: &Results) -> Result<Shown, Error> {
        known_metric(name, "x", &self.x, results)?;
        if !results.metric_columns().iter().any(|column| column == SOLVED) {
            return Err(Error::request(format!("view `{name}`: the results lack the metric `{SOLVED}`")));
        }
        let solved = |algorithm: &String| {
            let own = results.rows.iter().filter(|row| row.algorithm == *algorithm);
            own.filter(|row| row.metric(SOLVED).is_some_and(|share| share > 0.0)).collect::<Vec<_>>()
        };
        let times = |algorithm: &String| {
            let mut times = values(&solved(algorithm), &self.x);
            times.sort_by(f64::total_cmp);
            times
        };
        let all = results.algorithms().into_iter();
        let lines: Vec<_> = all.map(|algorithm| (algorithm.clone(), times(&algorithm))).collect();
        if lines.iter().all(|(_, times)| times.is_empty()) {
            return Err(Error::request(format!("view `{name}`: no solved row has `{}`", self.x)));
        }
        let mut notes = lacking(&results.rows, &[self.x.clone(), SOLVED.to_owned()]);
        let times = lines.iter().flat_map(|(_, times)| times).copied();
        notes.extend(linear_note(name, self.style.log_x, times));
        let idle = lines.iter().filter(|(_, times)| times.is_empty());
        notes.extend(idle.map(|(name, _)| match solved(name).len() {
            0 => format!("`{name}` solved no instance"),
            _ => format!("`{name}` has no solved row with `{}`", self.x),
        }));
        Ok(Shown { pictures: vec![self.draw(&lines)], notes, ..Shown::default() })
    }

    fn draw(&self, lines: &[(String, Vec<f64>)]) -> Picture {
        let all: Vec<f64> = lines.iter().flat_map(|(_, times)| times).copied().collect();
        let is_log = self.style.log_x && all.iter().all(|&time| time > 0.0);
        let end = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let most = lines.iter().map(|(_, times)| times.len()).max().unwrap_or(0) as f64;
        let (mut plots, mut entries) = (Vec::new(), Vec::new());
        for (number, (name, times)) in lines.iter().enumerate().filter(|(_, (_, times))| !times.is_empty()) {
            let mut points: Vec<(f64, f64)> =
                times.iter().enumerate().map(|(count, &time)| (time, count as f64 + 1.0)).collect();
            points.push((end, times.len() as f64));
            let (colour, _, dashes) = signs(number, &self.style);
            let line = LinePlot::new()
                .with_data(points)
                .with_step()
                .with_color(colour)
                .with_stroke_width(self.style.line_width)
                .with_line_style(dashes.map_or(LineStyle::Solid, LineStyle::Custom));
            plots.push(Plot::Line(line));
            if self.style.has_markers {
                // A marker at the end identifies the line in greyscale, too.
                plots.extend(dots(&[(end, times.len() as f64)], number, &self.style));
            }
            entries.push(Series::entry(number, self.common.algorithm(name), &self.style));
        }
        let x = Axis::of_numbers(&self.common.title(&self.x), &all, is_log, self.style.ticks.as_deref());
        let y = Axis::of_numbers("Solved Instances", &[0.0, most], false, None);
        let columns = self.style.legend_columns;
        let legend = Legend { title: None, entries, columns, font_size: self.style.legend_font_size };
        let scene = single(&self.style, legend, |style| {
            let frame = style.frame(x, y);
            (framed(plots, &frame), Some(frame))
        });
        Picture::new(scene, &self.style)
    }
}
