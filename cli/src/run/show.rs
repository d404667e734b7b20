//! Frames in the terminal.

use std::time::Duration;

use console::{Style, Term};
use pogema_core::picture::{Mark, agent_letter, marks};
use pogema_core::{Error, Map, Snapshot};

use super::episode::Episode;
use crate::output::said;
use crate::output::say;

/// A terminal that shows one frame over the other, or any other output that gets them one after the other.
pub struct Screen {
    terminal: Term,
    pause: Duration,
    num_lines: usize,
}

impl Screen {
    pub fn new(fps: f64) -> Self {
        let pause = if fps > 0.0 {
            Duration::try_from_secs_f64(1.0 / fps).unwrap_or_default()
        } else {
            Duration::ZERO
        };
        Self { terminal: Term::stdout(), pause, num_lines: 0 }
    }

    pub fn draw(&mut self, episode: &Episode) -> Result<(), Error> {
        let frame = frame(episode.instance().map(), &episode.snapshot(), episode.num_steps());
        if !self.terminal.is_term() {
            return say(&frame);
        }
        said(self.terminal.clear_last_lines(self.num_lines))?;
        self.num_lines = frame.lines().count();
        said(self.terminal.write_line(&frame))?;
        std::thread::sleep(self.pause);
        Ok(())
    }
}

/// One picture with a frame around it: agents are letters, their goals the same in capitals.
fn frame(map: &Map, snapshot: &Snapshot, step: usize) -> String {
    let marks = marks(map, snapshot);
    let edge = "──".repeat(map.width());
    let mut lines = vec![format!("step {step}"), format!("┌{edge}─┐")];
    for row in marks.chunks(map.width()) {
        let cells: Vec<String> = row.iter().map(|&mark| paint(mark)).collect();
        lines.push(format!("│ {} │", cells.join(" ")));
    }
    lines.push(format!("└{edge}─┘"));
    lines.join("\n")
}

fn paint(mark: Mark) -> String {
    const COLOURS: [u8; 6] = [196, 33, 40, 208, 129, 220];
    let colour = |agent: usize| Style::new().color256(COLOURS[agent % COLOURS.len()]);
    match mark {
        Mark::Free => Style::new().dim().apply_to('·').to_string(),
        Mark::Obstacle => '█'.to_string(),
        Mark::Agent(agent) => colour(agent).bold().apply_to(agent_letter(agent)).to_string(),
        Mark::Goal(agent) => {
            colour(agent).dim().apply_to(agent_letter(agent).to_ascii_uppercase()).to_string()
        }
    }
}
