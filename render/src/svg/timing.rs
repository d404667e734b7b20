//! The times at which elements change.

use std::fmt::Write as _;

use pogema_core::Cell;

/// The clock of an animation.
///
/// Time is counted in slots: the first frame is reached at slot 1, the next at slot 2 and so on, and the last is held
/// for one more slot. POGEMA's animations use the same timing.
pub struct Timing {
    num_frames: usize,
    /// The text at the end of every animation element.
    tail: String,
    /// Number of decimals of a time, enough for a hundredth of a frame.
    decimals: usize,
}

impl Timing {
    /// Returns the clock for this number of frames; none for a single frame. Units: `step_time` in seconds.
    pub fn new(num_frames: usize, step_time: f64) -> Option<Self> {
        // Viewers do not play an animation of duration 0.
        let duration = number_to((num_frames as f64 * step_time).max(1e-3), 4);
        let decimals = 3 + num_frames.checked_ilog10()? as usize;
        let tail = format!("dur=\"{duration}s\" repeatCount=\"indefinite\"/>");
        (num_frames > 1).then_some(Self { num_frames, tail, decimals })
    }

    /// Returns the animated path from cell to cell, relative to the first; none if the cell never changes.
    pub fn motion(&self, cell: impl Fn(usize) -> Cell) -> Option<String> {
        let (mut path, mut length) = (Path::default(), 0.0);
        let lengths = self.frames(|at| {
            if at > 0 {
                length += path.go(cell(at - 1), cell(at));
            }
            length
        });
        if length == 0.0 {
            return None;
        }
        let (times, points) = self.keys(&lengths, |at| number_to(at / length, decimals_of(length)));
        let path = path.finish();
        Some(format!(
            "<animateMotion path=\"{path}\" keyPoints=\"{points}\" keyTimes=\"{times}\" calcMode=\"linear\" {}",
            self.tail
        ))
    }

    /// Returns the animation of an attribute that changes linearly between frames; none if it never changes.
    pub fn numbers(&self, attribute: &str, value: impl Fn(usize) -> f64) -> Option<String> {
        let values = self.frames(value);
        if values.iter().all(|value| *value == values[0]) {
            return None;
        }
        let (times, values) = self.keys(&values, number);
        Some(format!(
            "<animate attributeName=\"{attribute}\" values=\"{values}\" keyTimes=\"{times}\" {}",
            self.tail
        ))
    }

    /// Returns the animation of an element's visibility; none if it never changes.
    pub fn visibility(&self, is_visible: impl Fn(usize) -> bool) -> Option<String> {
        let word = |at: usize| if is_visible(at) { "visible" } else { "hidden" };
        let (mut values, mut times) = (word(0).to_owned(), "0".to_owned());
        for frame in (1..self.num_frames).filter(|&at| is_visible(at) != is_visible(at - 1)) {
            let _ = write!(values, ";{}", word(frame));
            let _ = write!(times, ";{}", self.time(frame + 1));
        }
        (times != "0").then(|| {
            format!(
                "<animate attributeName=\"visibility\" values=\"{values}\" keyTimes=\"{times}\" calcMode=\"discrete\" {}",
                self.tail
            )
        })
    }

    fn frames(&self, mut value: impl FnMut(usize) -> f64) -> Vec<f64> {
        (0..self.num_frames).map(&mut value).collect()
    }

    /// Returns the times and values at the corners of the line through the values of all frames.
    fn keys(&self, frames: &[f64], text: impl Fn(f64) -> String) -> (String, String) {
        let (first, last) = (frames[0], frames[frames.len() - 1]);
        let slots: Vec<f64> = [&[first], frames, &[last]].concat();
        let (mut times, mut values) = ("0".to_owned(), text(first));
        for slot in 1..slots.len() {
            let rise = slots[slot] - slots[slot - 1];
            let is_corner = slots.get(slot + 1).is_none_or(|next| next - slots[slot] != rise);
            if is_corner {
                let _ = write!(times, ";{}", self.time(slot));
                let _ = write!(values, ";{}", text(slots[slot]));
            }
        }
        (times, values)
    }

    /// Returns a slot as a fraction of the whole duration.
    fn time(&self, slot: usize) -> String {
        number_to(slot as f64 / (self.num_frames + 1) as f64, self.decimals)
    }
}

/// Returns the number of decimals of a fraction of a path, enough for a hundredth of a cell. A goal can jump across the
/// map in one frame, so the number of frames does not bound the length of a path.
fn decimals_of(length: f64) -> usize {
    3 + (length as usize).checked_ilog10().unwrap_or(0) as usize
}

/// A path of straight segments, each as long as possible.
#[derive(Default)]
struct Path {
    text: String,
    /// The (rows, cols) of the segment that is not yet written.
    segment: (i64, i64),
}

impl Path {
    /// Extends the path from one cell to the next and returns the distance. Units: cells.
    fn go(&mut self, from: Cell, to: Cell) -> f64 {
        let (down, right) =
            (i32::from(to.row) - i32::from(from.row), i32::from(to.col) - i32::from(from.col));
        let distance = f64::from(down).hypot(f64::from(right));
        let (down, right) = (i64::from(down), i64::from(right));
        let (rows, cols) = self.segment;
        let is_straight = rows * right == cols * down && rows * down >= 0 && cols * right >= 0;
        if !is_straight {
            self.flush();
        }
        self.segment = (self.segment.0 + down, self.segment.1 + right);
        distance
    }

    fn flush(&mut self) {
        let _ = match std::mem::take(&mut self.segment) {
            (0, 0) => Ok(()),
            (0, cols) => write!(self.text, "h{cols}"),
            (rows, 0) => write!(self.text, "v{rows}"),
            (rows, cols) => write!(self.text, "l{cols} {rows}"),
        };
    }

    fn finish(mut self) -> String {
        self.flush();
        format!("M0 0{}", self.text)
    }
}

/// Formats a number with at most three decimals in as few characters as possible.
pub fn number(value: f64) -> String {
    number_to(value, 3)
}

fn number_to(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    match text
        .strip_prefix("-0.")
        .map(|rest| ("-.", rest))
        .or(text.strip_prefix("0.").map(|rest| (".", rest)))
    {
        Some((sign, rest)) => format!("{sign}{rest}"),
        None if text == "-0" => "0".to_owned(),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_that_jump_far_are_drawn_in_their_cells() {
        let goals = [1, 2, 3, 2999, 2999].map(|col| Cell::new(0, col));
        let motion = Timing::new(goals.len(), 0.25).and_then(|timing| timing.motion(|at| goals[at]));
        let motion = motion.unwrap_or_default();
        let points = motion.split("keyPoints=\"").nth(1).and_then(|rest| rest.split('"').next());
        let points: Vec<f64> = points.unwrap_or_default().split(';').flat_map(str::parse).collect();
        let cols: Vec<f64> = points.iter().map(|point| 1.0 + point * 2998.0).collect();
        // Column 2 lies on a straight line in time and space, so it needs no key.
        for goal in [1.0, 3.0, 2999.0] {
            assert!(cols.iter().any(|col| (col - goal).abs() < 0.01), "no key at column {goal}: {cols:?}");
        }
    }

    #[test]
    fn paths_of_goals_that_jump_across_the_largest_maps_are_exact() {
        let jumps =
            [(0, 0), (60_000, 65_535), (5_000, 1), (65_535, 65_535)].map(|(row, col)| Cell::new(row, col));
        let motion = Timing::new(jumps.len(), 0.25).and_then(|timing| timing.motion(|at| jumps[at]));
        assert!(
            motion.is_some_and(|text| text.contains("path=\"M0 0l65535 60000l-65534 -55000l65534 60535\""))
        );
    }
}
