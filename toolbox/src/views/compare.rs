//! Comparison of two algorithms, instance by instance.

use kuva::plot::line::LinePlot;
use kuva::plot::scatter::ScatterPlot;
use kuva::render::plots::Plot;
use pogema_core::{Error, counted};

use super::axes::{Axis, Frame, linear_note};
use super::options::{Common, Options};
use super::page::framed;
use super::pairing::Pairing;
use super::picture::Picture;
use super::style::{COLUMN, Style};
use super::table::{Cell, Table};
use super::{Shown, known_metric, unknown_name};
use crate::groups::lacking;
use crate::results::{Results, Row, is_higher_better};
use crate::six::instance;
use crate::tree::Node;

/// `type: compare`: a dot for each instance that the algorithms `first` and `second` both solved, and a table of wins.
///
/// `y` is the metric [default: `SoC`]. `better` is `lower` or `higher` [default: `higher` for `CSR`, `ISR` and
/// `avg_throughput`, else `lower`]. Results without `CSR`, for example lifelong ones, count as solved. If the
/// metric is `CSR`, `ISR` or `avg_throughput`, unsolved instances count, too.
#[derive(Clone, Debug)]
pub struct CompareView {
    common: Common,
    style: Style,
    metric: String,
    first: Option<String>,
    second: Option<String>,
    is_higher_better: bool,
}

/// The outcomes of the instances of two algorithms.
#[derive(Clone, Debug, Default)]
struct Score {
    /// The values of both algorithms, for instances that count for both.
    both: Vec<(f64, f64)>,
    only_first: usize,
    only_second: usize,
    neither: usize,
    /// Number of instances for which at least one of the algorithms has no row or no value.
    alone: usize,
}

impl CompareView {
    pub(super) fn read(name: &str, node: &Node) -> Result<Self, Error> {
        let options = Options::new(name, node, &Style::keys(&["first", "second", "better"]))?;
        let metric = options.text("y")?.unwrap_or_else(|| "SoC".to_owned());
        let is_higher_better = match options.choice("better", &["lower", "higher"])? {
            Some(better) => better == "higher",
            None => is_higher_better(&metric),
        };
        Ok(Self {
            common: Common::read(&options)?,
            style: Style::read(&options, COLUMN)?,
            metric,
            first: options.text("first")?,
            second: options.text("second")?,
            is_higher_better,
        })
    }

    /// Counts the wins and draws the plot.
    ///
    /// # Errors
    /// If the results lack the metric or the algorithms; if `first` and `second` do not name two different algorithms;
    /// if neither is given and the results do not have exactly two algorithms.
    pub(super) fn show(&self, name: &str, results: &Results) -> Result<Shown, Error> {
        known_metric(name, "y", &self.metric, results)?;
        let pair = self.pair(name, results)?;
        let score = self.score(results, &pair);
        let rows = results.rows.iter().filter(|row| pair.contains(&row.algorithm));
        let mut notes = lacking(rows, std::slice::from_ref(&self.metric));
        if score.alone > 0 {
            let left_out = counted(score.alone, "instance");
            notes.push(format!("view `{name}`: {left_out} left out, because a row or its value is missing"));
        }
        let pictures = if score.both.is_empty() {
            notes.push(format!("view `{name}`: no instance counts for both algorithms, so there is no plot"));
            Vec::new()
        } else {
            let values = score.both.iter().flat_map(|&(one, other)| [one, other]);
            notes.extend(linear_note(name, self.style.log_x || self.style.log_y, values));
            vec![self.draw(&pair, &score.both)]
        };
        Ok(Shown { tables: vec![self.table(&pair, &score)], pictures, notes })
    }

    /// Returns the named algorithms, or the only two of the results if none are named.
    fn pair(&self, name: &str, results: &Results) -> Result<[String; 2], Error> {
        let all = results.algorithms();
        let (first, second) = match (&self.first, &self.second, all.as_slice()) {
            (Some(first), Some(second), _) | (None, None, [first, second]) => (first.clone(), second.clone()),
            _ => {
                let known = all.join(", ");
                let reason = format!("view `{name}`: expected `first` and `second`, each one of {known}");
                return Err(Error::request(reason));
            }
        };
        for (key, algorithm) in [("first", &first), ("second", &second)] {
            if !all.contains(algorithm) {
                let known = all.iter().map(String::as_str);
                return Err(unknown_name(name, key, algorithm, "an algorithm of the results", known));
            }
        }
        if first == second {
            let reason =
                format!("view `{name}`: `first` and `second` are both `{first}`, expected two algorithms");
            return Err(Error::request(reason));
        }
        Ok([first, second])
    }

    fn score<'a>(&self, results: &'a Results, [first, second]: &'a [String; 2]) -> Score {
        let of = |algorithm: &'a String| results.rows.iter().filter(move |row| row.algorithm == *algorithm);
        let pairing = Pairing::of(of(first), of(second), instance);
        let mut score = Score { alone: pairing.alone, ..Score::default() };
        for (one, other) in pairing.pairs {
            match (self.counts(one), self.counts(other)) {
                (true, true) => match (one.metric(&self.metric), other.metric(&self.metric)) {
                    (Some(one), Some(other)) => score.both.push((one, other)),
                    _ => score.alone += 1,
                },
                (true, false) => score.only_first += 1,
                (false, true) => score.only_second += 1,
                (false, false) => score.neither += 1,
            }
        }
        score
    }

    /// Returns whether the values of unsolved rows count.
    fn counts_unsolved(&self) -> bool {
        is_higher_better(&self.metric)
    }

    /// Returns whether the value of a row counts.
    fn counts(&self, row: &Row) -> bool {
        self.counts_unsolved() || row.is_solved()
    }

    fn table(&self, pair: &[String; 2], score: &Score) -> Table {
        let [first, second] = pair.each_ref().map(|name| self.common.algorithm(name));
        let is_less = |&&(one, other): &&(f64, f64)| one < other;
        let ties = score.both.iter().filter(|(one, other)| one == other).count();
        let less = score.both.iter().filter(is_less).count();
        let more = score.both.len() - ties - less;
        let (wins, losses) = if self.is_higher_better { (more, less) } else { (less, more) };
        let row = |what: String, count: usize| vec![Cell::Text(what), Cell::Count(count)];
        let metric = self.common.title(&self.metric);
        let mut rows = vec![
            row(format!("{first} is better"), wins),
            row("both are equal".to_owned(), ties),
            row(format!("{second} is better"), losses),
        ];
        if !self.counts_unsolved() {
            rows.extend([
                row(format!("only {first} solved it"), score.only_first),
                row(format!("only {second} solved it"), score.only_second),
                row("neither solved it".to_owned(), score.neither),
            ]);
        }
        let head = vec![format!("{first} and {second}: {metric}"), "Instances".to_owned()];
        Table { head, rows, ..Table::default() }
    }

    fn draw(&self, pair: &[String; 2], both: &[(f64, f64)]) -> Picture {
        let all: Vec<f64> = both.iter().flat_map(|&(one, other)| [one, other]).collect();
        let is_log = (self.style.log_x || self.style.log_y) && all.iter().all(|&value| value > 0.0);
        let [x, y] = pair.each_ref().map(|name| {
            let title = format!("{}, {}", self.common.title(&self.metric), self.common.algorithm(name));
            Axis::of_numbers(&title, &all, is_log, self.style.ticks.as_deref())
        });
        let (low, high) = x.range;
        let diagonal = LinePlot::new().with_data([(low, low), (high, high)]).with_color("#888888");
        let dots = ScatterPlot::new().with_data(both.to_vec()).with_color(self.style.colour(0));
        let dots = dots.with_size(1.6).with_marker_opacity(0.5);
        let plots = vec![Plot::Line(diagonal.with_stroke_width(0.7)), Plot::Scatter(dots)];
        let frame = Frame { is_square: true, ..self.style.frame(x, y) };
        Picture::new(framed(plots, &frame), &self.style)
    }
}
