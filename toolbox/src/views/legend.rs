//! Legends of plots.

use kuva::render::plots::Plot;
use kuva::render::render::{Primitive, Scene, TextAnchor};

use super::axes::{anchored, text, text_width};
use super::compose::{bare, insert, plain_layout};

/// Line height, relative to the font size.
const LINE: f64 = 1.5;

/// Width of an entry's symbol and the space next to it. Units: points.
const SYMBOL: f64 = 30.0;

/// One line of a legend.
pub(super) struct Entry {
    pub label: String,
    /// The symbol next to the label, in coordinates from 0 to 1.
    pub symbol: Vec<Plot>,
}

/// A legend before it is placed.
pub(super) struct Legend {
    pub title: Option<String>,
    pub entries: Vec<Entry>,
    pub columns: usize,
    pub font_size: u32,
}

impl Legend {
    fn line_height(&self) -> f64 {
        f64::from(self.font_size) * LINE
    }

    fn column_width(&self) -> f64 {
        let labels = self.entries.iter().map(|entry| text_width(&entry.label, self.font_size));
        SYMBOL + labels.fold(0.0, f64::max) + f64::from(self.font_size)
    }

    /// Reduces the number of columns until the legend is at most as wide as the page, and fills its lines evenly.
    pub fn fit(&mut self, width: f64) {
        let most = ((width - 4.0) / self.column_width()).floor().max(1.0) as usize;
        let count = self.entries.len().max(1);
        self.columns = count.div_ceil(count.div_ceil(self.columns.clamp(1, most)));
    }

    fn num_columns(&self) -> usize {
        self.columns.clamp(1, self.entries.len().max(1))
    }

    /// Returns the width and height of the legend.
    pub fn size(&self) -> (f64, f64) {
        let lines = self.entries.len().div_ceil(self.num_columns()) + usize::from(self.title.is_some());
        let title = self.title.as_ref().map_or(0.0, |title| text_width(title, self.font_size) + 6.0);
        let width = (self.column_width() * self.num_columns() as f64 + 4.0).max(title);
        (width, lines as f64 * self.line_height() + 4.0)
    }

    /// Draws the legend with its upper left corner at a position.
    pub fn draw(self, scene: &mut Scene, (left, top): (f64, f64), has_box: bool) {
        let (width, height) = self.size();
        if has_box {
            scene.add(Primitive::Rect {
                x: left,
                y: top,
                width,
                height,
                fill: "#FFFFFF".into(),
                stroke: Some("#CCCCCC".into()),
                stroke_width: Some(0.5),
                opacity: Some(0.85),
            });
        }
        let mut first = top + 2.0;
        if let Some(title) = &self.title {
            let place = (left + width / 2.0, first + f64::from(self.font_size));
            scene.add(text(title, place, self.font_size));
            first += self.line_height();
        }
        let (columns, column_width, line_height) =
            (self.num_columns(), self.column_width(), self.line_height());
        for (number, entry) in self.entries.into_iter().enumerate() {
            let (row, column) = (number / columns, number % columns);
            let place = (left + column as f64 * column_width + 4.0, first + row as f64 * line_height);
            draw_entry(scene, entry, place, self.font_size);
        }
    }
}

fn draw_entry(scene: &mut Scene, entry: Entry, (x, y): (f64, f64), size: u32) {
    let height = f64::from(size) * LINE;
    let blank = plain_layout((SYMBOL - 6.0, height), (0.0, 1.0), (0.0, 1.0));
    insert(scene, bare(entry.symbol, blank), (x, y));
    let place = (x + SYMBOL - 2.0, y + height / 2.0 + f64::from(size) * 0.36);
    scene.add(anchored(&entry.label, place, size, TextAnchor::Start, None));
}
