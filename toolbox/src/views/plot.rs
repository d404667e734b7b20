//! Plots of means, with one or several panels.

use kuva::render::render::Scene;
use pogema_core::Error;
use serde_json::Value;

use super::axes::{Axis, Frame, linear_note};
use super::legend::Legend;
use super::options::{Common, Options};
use super::page::{framed, grid, single};
use super::picture::Picture;
use super::series::{Places, Series, distinct, has, means, placeless};
use super::style::{COLUMN, Style};
use super::{Shown, known_column, known_metric};
use crate::bootstrap::{RESAMPLES, Spread};
use crate::groups::{lacking, shown};
use crate::results::{ALGORITHM, Results, Row};
use crate::tree::Node;

/// `type: plot` and `type: multi-plot`: the mean of a metric over a varied field, with a line for each algorithm.
///
/// A band around each line shows the interval of its means. A `multi-plot` has one panel for each value of the column
/// `over`.
///
/// Source: pogema-toolbox 0.1.1, `view_plot.py`, `view_multi_plot.py`
#[derive(Clone, Debug)]
pub struct PlotView {
    common: Common,
    style: Style,
    x: String,
    y: String,
    by: String,
    spread: Spread,
    panels: Option<Panels>,
}

/// Default size of a panel; three of them span a page. Units: inches.
const PANEL: (f64, f64) = (2.33, 2.1);

/// The options of a plot with several panels.
#[derive(Clone, Debug)]
struct Panels {
    over: String,
    columns: usize,
    share_x: bool,
    share_y: bool,
    have_titles: bool,
}

/// One panel before it is drawn.
struct Content<'a> {
    rows: Vec<&'a Row>,
    title: Option<String>,
    series: Vec<Series>,
}

impl PlotView {
    pub(super) fn read(name: &str, node: &Node, is_multiple: bool) -> Result<Self, Error> {
        let own = ["over", "num_cols", "share_x", "share_y", "remove_individual_titles"];
        let options = Options::new(name, node, &Style::keys(if is_multiple { &own } else { &[] }))?;
        let panels = is_multiple.then(|| Panels::read(&options)).transpose()?;
        Ok(Self {
            common: Common::read(&options)?,
            style: Style::read(&options, if is_multiple { PANEL } else { COLUMN })?,
            x: options.required("x")?,
            y: options.required("y")?,
            by: options.text("by")?.unwrap_or_else(|| ALGORITHM.to_owned()),
            spread: spread(&options)?,
            panels,
        })
    }

    /// Draws the plot.
    ///
    /// # Errors
    /// If the results lack a column, or no row has values in both `x` and `y`.
    pub(super) fn show(&self, name: &str, results: &Results) -> Result<Shown, Error> {
        let over = self.panels.as_ref().map(|panels| ("over", &panels.over));
        for (key, column) in [("x", &self.x), ("by", &self.by)].into_iter().chain(over) {
            known_column(name, key, column, results)?;
        }
        known_metric(name, "y", &self.y, results)?;
        let (names, mut notes) = self.lines(results);
        let places = Places::of(&results.rows, &self.x);
        let mut contents = self.contents(results);
        for content in &mut contents {
            for (number, value) in names.iter().enumerate() {
                let mut rows = content.rows.clone();
                rows.retain(|row| has(row, &self.by, value));
                let points = means(&rows, &self.x, &places, &self.y, self.spread);
                if !points.is_empty() {
                    content.series.push(Series { number, points });
                }
            }
        }
        if contents.iter().all(|content| content.series.is_empty()) {
            let reason =
                format!("view `{name}`: no row to draw has both `{}` and a number in `{}`", self.x, self.y);
            return Err(Error::request(reason));
        }
        notes.extend(placeless(
            &results.rows,
            [&self.x, &self.by].into_iter().chain(over.map(|(_, over)| over)),
        ));
        notes.extend(lacking(&results.rows, std::slice::from_ref(&self.y)));
        let scene = self.draw(&contents, &names, &places);
        let picture = Picture::new(scene, &self.style);
        notes.extend(self.remarks(name, &contents));
        Ok(Shown { pictures: vec![picture], notes, ..Shown::default() })
    }

    /// Returns the values that have a line, in the order of their colours, and notes on values without a line.
    fn lines(&self, results: &Results) -> (Vec<Value>, Vec<String>) {
        let found = distinct(&results.rows, &self.by);
        let Some(order) = &self.style.order else { return (found, Vec::new()) };
        let is_named = |value: &Value, name: &String| {
            shown(value) == *name || self.common.shown(&self.by, value) == *name
        };
        let mut ordered: Vec<Value> = Vec::new();
        for value in order.iter().filter_map(|name| found.iter().find(|value| is_named(value, name))) {
            if !ordered.contains(value) {
                ordered.push(value.clone());
            }
        }
        let left_out = found.iter().filter(|value| !ordered.contains(value));
        let notes = left_out.map(|value| format!("`{}` is not in `hue_order` and not drawn", shown(value)));
        let notes = notes.collect();
        (ordered, notes)
    }

    /// Returns the rows of each panel.
    fn contents<'a>(&self, results: &'a Results) -> Vec<Content<'a>> {
        let Some(panels) = &self.panels else {
            let title = self.style.title().map(str::to_owned);
            return vec![Content { rows: results.rows.iter().collect(), title, series: Vec::new() }];
        };
        let content = |value: Value| {
            let rows = results.rows.iter().filter(|row| has(row, &panels.over, &value));
            let title = panels.have_titles.then(|| self.panel_title(&panels.over, &value));
            Content { rows: rows.collect(), title, series: Vec::new() }
        };
        distinct(&results.rows, &panels.over).into_iter().map(content).collect()
    }

    /// Returns the value of a panel, with the title of its column if the value alone says nothing.
    fn panel_title(&self, column: &str, value: &Value) -> String {
        let text = self.common.shown(column, value);
        if value.is_string() { text } else { format!("{}: {text}", self.common.title(column)) }
    }

    fn frame(&self, content: &Content<'_>, all: &[Content<'_>], places: &Places) -> Frame {
        let of = |is_shared: bool| if is_shared { all } else { std::slice::from_ref(content) };
        let points = |contents: &[Content<'_>],
                      read: &dyn Fn(&(f64, crate::bootstrap::Estimate)) -> Vec<f64>| {
            let series = contents.iter().flat_map(|content| &content.series);
            series.flat_map(|series| series.points.iter().flat_map(read)).collect::<Vec<f64>>()
        };
        let (share_x, share_y) =
            self.panels.as_ref().map_or((false, false), |panels| (panels.share_x, panels.share_y));
        let xs = points(of(share_x), &|(x, _)| vec![*x]);
        let ys = points(of(share_y), &|(_, found)| {
            let (low, high) = found.interval.unwrap_or((found.mean, found.mean));
            vec![found.mean, low, high]
        });
        let x_title = self.common.title(&self.x);
        let x = match places {
            Places::Names(names) => {
                let names: Vec<String> = names.iter().map(|name| self.common.shown(&self.x, name)).collect();
                Axis::of_names(&x_title, &names, 0.0)
            }
            Places::Numbers => {
                let is_log = self.style.log_x && xs.iter().all(|&x| x > 0.0);
                x_axis(&x_title, &xs, is_log, self.style.ticks.as_deref())
            }
        };
        let is_log = self.style.log_y && ys.iter().all(|&y| y > 0.0);
        let y = Axis::of_numbers(&self.common.title(&self.y), &ys, is_log, None);
        Frame { title: content.title.clone(), ..self.style.frame(x, y) }
    }

    fn draw(&self, contents: &[Content<'_>], names: &[Value], places: &Places) -> Scene {
        let used = names.iter().enumerate().filter(|(number, _)| {
            contents.iter().flat_map(|content| &content.series).any(|series| series.number == *number)
        });
        let entries =
            used.map(|(number, name)| Series::entry(number, self.common.shown(&self.by, name), &self.style));
        let legend = Legend {
            title: self.style.has_legend_title.then(|| self.common.title(&self.by)),
            entries: entries.collect(),
            columns: self.style.legend_columns,
            font_size: self.style.legend_font_size,
        };
        let draw = |content: &Content<'_>, height: f64| {
            let frame = Frame { height, ..self.frame(content, contents, places) };
            let plots = content.series.iter().flat_map(|series| series.plots(&self.style)).collect();
            (framed(plots, &frame), Some(frame))
        };
        if let Some(panels) = &self.panels {
            let parts = contents.iter().map(|content| draw(content, self.style.height).0).collect();
            grid(&self.style, parts, panels.columns, legend)
        } else {
            single(&self.style, legend, |style| draw(&contents[0], style.height))
        }
    }

    /// Returns notes that explain the plot.
    fn remarks(&self, name: &str, contents: &[Content<'_>]) -> Vec<String> {
        let points = || contents.iter().flat_map(|content| &content.series).flat_map(|series| &series.points);
        let xs = points().map(|(x, _)| *x);
        let lows = points().map(|(_, found)| found.interval.map_or(found.mean, |(low, _)| low));
        let linear =
            linear_note(name, self.style.log_x, xs).or_else(|| linear_note(name, self.style.log_y, lows));
        let bands = match self.spread {
            Spread::Bootstrap { level } => Some(format!(
                "view `{name}`: bands are {level} % bootstrap intervals of the means ({RESAMPLES} resamples)"
            )),
            _ => None,
        };
        linear.into_iter().chain(bands).collect()
    }
}

impl Panels {
    fn read(options: &Options<'_>) -> Result<Self, Error> {
        Ok(Self {
            over: options.required("over")?,
            columns: options.whole("num_cols", 100)?.unwrap_or(3).max(1),
            share_x: options.flag("share_x")?.unwrap_or(false),
            share_y: options.flag("share_y")?.unwrap_or(false),
            have_titles: !options.flag("remove_individual_titles")?.unwrap_or(false),
        })
    }
}

/// Creates the horizontal axis with the view's ticks. Without them, each value has a tick if there are at most 16
/// distinct ones.
fn x_axis(title: &str, values: &[f64], is_log: bool, ticks: Option<&[f64]>) -> Axis {
    let mut distinct = values.to_vec();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup();
    let own = (1..=16).contains(&distinct.len()).then_some(distinct.as_slice());
    Axis::of_numbers(title, values, is_log, ticks.or(own))
}

/// Reads `error_bar`, such as `[ci, 95]` [default: `[ci, 95]`].
fn spread(options: &Options<'_>) -> Result<Spread, Error> {
    let Some(values) = options.values("error_bar")? else { return Ok(Spread::Bootstrap { level: 95.0 }) };
    let level = values.get(1).and_then(Value::as_f64).filter(|&level| level > 0.0);
    match (values.first().and_then(Value::as_str), level) {
        (Some("ci"), Some(level)) if level <= 100.0 => Ok(Spread::Bootstrap { level }),
        (Some("sd"), Some(factor)) => Ok(Spread::Deviation { factor }),
        _ => Err(options.reject("error_bar", "`[ci, 95]` or `[sd, 1]`")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::views::{ImageFormat, View};

    fn results() -> Results {
        let row = |number: u64, algorithm: &str, soc: Value| {
            let (metrics, settings) = (json(&[("SoC", soc)]), json(&[("num_agents", (number % 3).into())]));
            Row { metrics, settings, algorithm: algorithm.into(), ..Row::default() }
        };
        let rows =
            (0..12).flat_map(|number| [row(number, "A", number.into()), row(number, "B & <C>", Value::Null)]);
        Results { rows: rows.collect(), notes: Vec::new() }
    }

    fn json(pairs: &[(&str, Value)]) -> crate::Pairs {
        pairs.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect()
    }

    fn show(fields: &str) -> Result<Shown, String> {
        let view = View::read("Plot1", &Node::parse(fields).unwrap());
        view.and_then(|view| view.show("Plot1", &results(), None)).map_err(|error| error.to_string())
    }

    #[test]
    fn every_format_is_written_and_missing_values_are_noted() {
        let shown = show("{type: plot, x: num_agents, y: SoC, name: One, extension: svg}").unwrap();
        let picture = &shown.pictures[0];
        assert_eq!(picture.kind, ImageFormat::Svg);
        let svg = String::from_utf8(picture.bytes(ImageFormat::Svg).unwrap()).unwrap();
        for text in [">One<", ">Number of Agents<", ">SoC<", ">A<"] {
            assert!(svg.contains(text), "{text}: {svg}");
        }
        // An algorithm without numbers has no line.
        assert!(!svg.contains("B &"), "{svg}");
        assert!(picture.bytes(ImageFormat::Pdf).unwrap().starts_with(b"%PDF"));
        assert!(picture.bytes(ImageFormat::Png).unwrap().starts_with(b"\x89PNG"));
        // A name that is listed twice has one line.
        let twice = show("{type: plot, x: num_agents, y: SoC, hue_order: [A, A, B & <C>]}").unwrap();
        let twice = String::from_utf8(twice.pictures[0].bytes(ImageFormat::Svg).unwrap()).unwrap();
        assert_eq!(twice.matches(">A<").count(), 1, "{twice}");
        assert_eq!(shown.notes[0], "`B & <C>` has no `SoC` in 12 of 12 rows; these rows are left out");
    }

    #[test]
    fn each_value_of_over_has_a_panel() {
        let shown = show("{type: multi-plot, x: num_agents, y: SoC, over: num_agents, num_cols: 2}").unwrap();
        let svg = String::from_utf8(shown.pictures[0].bytes(ImageFormat::Svg).unwrap()).unwrap();
        assert_eq!(svg.matches(">SoC<").count(), 3);
    }

    #[test]
    fn missing_data_and_invalid_options_are_rejected() {
        let error_of = |fields: &str| show(fields).unwrap_err();
        assert!(error_of("{type: plot, x: num_agent, y: SoC}").contains("did you mean `num_agents`?"));
        let field = error_of("{type: plot, x: SoC, y: num_agents}");
        assert!(field.contains("`y` is `num_agents`, expected a metric of the results"), "{field}");
        assert!(error_of("{type: plot, y: SoC}").contains("lacks the field `x`"));
        assert!(
            error_of("{type: plot, x: num_agents, y: SoC, hue_order: [\"B & <C>\"]}")
                .contains("no row to draw has both")
        );
        assert!(
            error_of("{type: plot, x: num_agents, y: SoC, width: -1}")
                .contains(".width` is `-1`, expected a number above 0 and below 10000")
        );
        assert!(
            error_of("{type: plot, x: num_agents, y: SoC, palette: [\"#12\"]}").contains("expected colours")
        );
        assert!(error_of("{type: plot, x: num_agents, y: SoC, over: seed}").contains("unknown key `over`"));
    }
}
