//! Frames in the terminal.

use std::time::Duration;

use console::Term;
use pogema_core::{Error, Snapshot};
use pogema_render::{Ground, text};

use crate::output::{said, say};

/// A terminal that shows one frame over the other, or any other output that gets them one after the other.
pub struct Screen {
    terminal: Term,
    style: text::Style,
    pause: Duration,
    num_lines: usize,
}

impl Screen {
    /// A screen of so many frames per second; of 0 and less, without a pause between them.
    pub fn new(style: text::Style, fps: f64) -> Self {
        let pause = if fps > 0.0 {
            Duration::try_from_secs_f64(1.0 / fps).unwrap_or_default()
        } else {
            Duration::ZERO
        };
        let style = text::Style { is_colored: console::colors_enabled(), ..style };
        Self { terminal: Term::stdout(), style, pause, num_lines: 0 }
    }

    pub fn draw(&mut self, ground: Ground<'_>, step: usize, state: &Snapshot) -> Result<(), Error> {
        if !self.terminal.is_term() {
            return say(&text::frame(ground, step, state, &self.style)?);
        }
        // The cursor waits on a line of its own. A frame is as large as the terminal is now.
        let size = self.terminal.size_checked();
        let most =
            size.map(|(rows, cols)| (usize::from(rows).saturating_sub(1).max(1), usize::from(cols).max(1)));
        let frame = text::frame(ground, step, state, &text::Style { most, ..self.style })?;
        said(self.terminal.clear_last_lines(self.num_lines))?;
        self.num_lines = frame.lines().count();
        said(self.terminal.write_line(&frame))?;
        std::thread::sleep(self.pause);
        Ok(())
    }
}
