//! The part of a map that fits the terminal.

use std::fmt::Write as _;
use std::ops::Range;

use pogema_core::Snapshot;

use super::Style;
use crate::ground::{Border, Ground};

/// The cells that are drawn.
pub struct Viewport {
    pub rows: Range<i32>,
    pub cols: Range<i32>,
    /// All rows and all columns that could be drawn.
    whole: [Range<i32>; 2],
}

impl Viewport {
    pub fn of(ground: Ground<'_>, state: &Snapshot, style: &Style, cell_width: usize) -> Self {
        // The thin border is a frame around the cells.
        let border = if style.border == Border::Thin { Border::None } else { style.border };
        let whole = [ground.rows(border), ground.cols(border)];
        let Some((most_rows, most_cols)) = style.max_size else {
            return Self { rows: whole[0].clone(), cols: whole[1].clone(), whole };
        };
        let frame = if style.border == Border::Thin { 2 } else { 0 };
        // The first line gives the step. The last cell of a row needs no gap. The frame takes a line above and
        // below, and a line and a gap on the left and on the right.
        let fitting_rows = most_rows.saturating_sub(1 + frame);
        let fitting_cols = most_cols.saturating_add(1).saturating_sub(2 * frame) / (cell_width + 1);
        let is_active = |&agent: &usize| state.active[agent];
        let centre =
            style.view.or_else(|| (0..state.cells.len()).find(is_active)).map(|agent| state.cells[agent]);
        let (row, col) = centre.map_or((0, 0), |cell| (i32::from(cell.row), i32::from(cell.col)));
        Self { rows: around(row, &whole[0], fitting_rows), cols: around(col, &whole[1], fitting_cols), whole }
    }

    /// Describes the drawn rows and columns, if not all are drawn.
    pub fn crop(&self) -> String {
        let mut text = String::new();
        for (name, shown, whole) in
            [("rows", &self.rows, &self.whole[0]), ("columns", &self.cols, &self.whole[1])]
        {
            if shown != whole {
                let (start, last, all) = (shown.start, shown.end - 1, whole.len());
                let _ = write!(text, "  {name} {start}..{last} of {all}");
            }
        }
        text
    }
}

/// Returns at most `fitting` numbers of a range, around `centre`; at least one.
fn around(centre: i32, whole: &Range<i32>, fitting: usize) -> Range<i32> {
    let length = fitting.clamp(1, whole.len()) as i32;
    let start = (centre - length / 2).clamp(whole.start, whole.end - length);
    start..start + length
}
