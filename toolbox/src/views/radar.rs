//! The six metrics of each algorithm, as a table and as a radar plot.

use kuva::plot::radar::RadarPlot;
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use pogema_core::{Error, Words};

use super::compose::bare;
use super::grid::{Cell, Table};
use super::legend::Legend;
use super::options::{Common, Options};
use super::picture::Picture;
use super::series::Series;
use super::style::Style;
use super::{Shown, axes};
use crate::results::{ALGORITHM, Results};
use crate::six::{Definition, Metric, Six, six};
use crate::tree::Node;

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
            style: Style::read(&options, (4.2, 3.2))?,
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
        let is_beyond = |six: &Six| six.values.iter().flatten().any(|&value| value > 1.0);
        if all.iter().any(is_beyond) {
            notes.push("values above 1 are drawn as 1".to_owned());
        }
        let is_known = |at: &usize| all.iter().any(|six| six.values[*at].is_some());
        let known: Vec<usize> = (0..Metric::NAMES.len()).filter(is_known).collect();
        let pictures = if known.len() < 3 {
            notes
                .push(format!("view `{name}`: a radar plot needs at least 3 metrics, found {}", known.len()));
            Vec::new()
        } else {
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
        let names = known.iter().map(|&at| self.common.title(Metric::NAMES[at]));
        let mut radar = RadarPlot::new(names)
            .with_range(0.0, 1.0)
            .with_grid_lines(4)
            .with_dot_size(self.style.line_width * 1.2)
            .with_stroke_width(self.style.line_width);
        for (number, six) in all.iter().enumerate() {
            let values: Vec<f64> = known.iter().map(|&at| six.values[at].unwrap_or(0.0).min(1.0)).collect();
            let colour = self.style.colour(number);
            radar = radar.with_series_color(values, self.common.algorithm(&six.algorithm), colour);
        }
        let size = f64::from(self.style.font_size);
        let mut layout = Layout::new((0.0, 1.0), (0.0, 1.0))
            .with_width(self.style.width)
            .with_height(self.style.height)
            .with_tick_size(self.style.font_size)
            .with_body_size(self.style.font_size)
            .with_label_size(self.style.font_size)
            .with_force_margins(0.0, 0.0)
            .with_force_margins_y(self.style.title().map_or(0.0, |_| size * 2.0), 0.0);
        layout.show_legend = false;
        let mut scene = bare(vec![Plot::Radar(radar)], layout);
        if let Some(title) = self.style.title() {
            scene.add(axes::text(title, (self.style.width / 2.0, size * 1.4), self.style.font_size));
        }
        // The library draws these lines without dashes in some formats.
        let plain = Style { has_markers: false, has_line_types: false, ..self.style.clone() };
        let entry = |(number, six): (usize, &Six)| {
            Series::entry(number, self.common.algorithm(&six.algorithm), &plain)
        };
        let entries = all.iter().enumerate().map(entry).collect();
        let legend = Legend { title: None, entries, columns: 1, font_size: self.style.legend_font_size };
        let (width, height) = legend.size();
        let top = (self.style.height - height).max(0.0) / 2.0;
        scene.width += width;
        scene.height = scene.height.max(height);
        legend.draw(&mut scene, (self.style.width, top), false);
        Picture::new(scene, &self.style)
    }
}
