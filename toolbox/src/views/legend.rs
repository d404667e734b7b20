//! Which line is whose.

use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::render::{Primitive, Scene, TextAnchor};

use super::axes::text_width;
use super::compose::{bare, insert};

/// Height of a line in heights of the font.
const LINE: f64 = 1.5;

/// How much of a line is its sign, and space beside it. Units: points.
const SIGN: f64 = 26.0;

/// One line of a legend.
pub(super) struct Entry {
    pub label: String,
    /// What is drawn beside it, in a square from 0 to 1.
    pub sign: Vec<Plot>,
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
        SIGN + labels.fold(0.0, f64::max) + f64::from(self.font_size)
    }

    fn num_columns(&self) -> usize {
        self.columns.clamp(1, self.entries.len().max(1))
    }

    /// How wide and how high it is.
    pub fn size(&self) -> (f64, f64) {
        let lines = self.entries.len().div_ceil(self.num_columns()) + usize::from(self.title.is_some());
        let title = self.title.as_ref().map_or(0.0, |title| text_width(title, self.font_size) + 6.0);
        let width = (self.column_width() * self.num_columns() as f64 + 4.0).max(title);
        (width, lines as f64 * self.line_height() + 4.0)
    }

    /// Draws it with its upper left corner at a place.
    pub fn draw(self, scene: &mut Scene, (left, top): (f64, f64), has_box: bool) {
        let (width, height) = self.size();
        if has_box {
            let (fill, stroke) = ("#FFFFFF".into(), Some("#CCCCCC".into()));
            let (x, y, opacity) = (left, top, Some(0.85));
            scene.add(Primitive::Rect {
                x,
                y,
                width,
                height,
                fill,
                stroke,
                stroke_width: Some(0.5),
                opacity,
            });
        }
        let mut first = top + 2.0;
        if let Some(content) = self.title.clone() {
            let (x, y) = (left + width / 2.0, first + f64::from(self.font_size));
            let (size, anchor) = (self.font_size, TextAnchor::Middle);
            scene.add(Primitive::Text {
                x,
                y,
                content,
                size,
                anchor,
                rotate: None,
                bold: false,
                color: None,
            });
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
    insert(scene, bare(entry.sign, blank(SIGN - 6.0, height)), (x, y));
    let (x, y) = (x + SIGN - 2.0, y + height / 2.0 + f64::from(size) * 0.36);
    let (content, anchor) = (entry.label, TextAnchor::Start);
    scene.add(Primitive::Text { x, y, content, size, anchor, rotate: None, bold: false, color: None });
}

/// A layout of nothing but the plot, from 0 to 1 in both directions.
fn blank(width: f64, height: f64) -> Layout {
    let mut layout = Layout::new((0.0, 1.0), (0.0, 1.0))
        .with_width(width)
        .with_height(height)
        .with_show_grid(false)
        .with_force_margins(0.0, 0.0)
        .with_force_margins_y(0.0, 0.0)
        .with_x_axis_min(0.0)
        .with_x_axis_max(1.0)
        .with_y_axis_min(0.0)
        .with_y_axis_max(1.0);
    (layout.suppress_x_ticks, layout.suppress_y_ticks, layout.show_legend) = (true, true, false);
    layout
}
