//! Draws frames in the terminal.

use std::time::Duration;

use console::Term;
use pogema_core::{Error, Snapshot};
use pogema_render::{Ground, text};

use crate::output::{check_printed, print_bytes};

/// Standard output for frames. In a terminal, each frame overwrites the previous one; other outputs receive one frame
/// after another.
pub struct Screen {
    terminal: Term,
    style: text::Style,
    pause: Duration,
    num_lines: usize,
}

impl Screen {
    /// Returns a screen that shows `fps` frames per second; if `fps` is 0 or less, without pauses.
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
            let frame = text::frame(ground, step, state, &self.style)?;
            // A frame holds only our own characters, and perhaps escape sequences of colours.
            return print_bytes(format!("{frame}\n").as_bytes());
        }
        // The last line is reserved for the cursor. The size is read each time, because the user may resize the
        // terminal.
        let size = self.terminal.size_checked();
        let max_size =
            size.map(|(rows, cols)| (usize::from(rows).saturating_sub(1).max(1), usize::from(cols).max(1)));
        let frame = text::frame(ground, step, state, &text::Style { max_size, ..self.style })?;
        check_printed(self.terminal.clear_last_lines(self.num_lines))?;
        self.num_lines = frame.lines().count();
        check_printed(self.terminal.write_line(&frame))?;
        std::thread::sleep(self.pause);
        Ok(())
    }
}
