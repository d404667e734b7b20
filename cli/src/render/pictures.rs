//! The flags that select the pictures of an episode and their style.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use clap::Args;
use pogema_conformance::files;
use pogema_core::{Error, Trace};
use pogema_render::{Border, Color, Colors, Style, gif, html, raster, svg, text, video};

use super::screen::Screen;
use crate::output::{check_files, flagged, progress_bar};
use crate::words::word;

const LONGER_SIDE_OF_GIF: u32 = 512;

/// Accepted numbers of steps per second.
const FPS: RangeInclusive<f64> = 0.001..=1000.0;

/// Default number of steps per second in the terminal.
const TERMINAL_FPS: f64 = 8.0;

#[derive(Args, Debug)]
pub struct Pictures {
    /// Write an SVG animation; with `--frame`, a still SVG picture
    #[arg(long, value_name = "FILE", help_heading = "Pictures")]
    svg: Option<PathBuf>,
    /// Write one frame as PNG; `--frame` selects it
    #[arg(long, value_name = "FILE", help_heading = "Pictures")]
    png: Option<PathBuf>,
    /// Write an animated GIF
    #[arg(long, value_name = "FILE", help_heading = "Pictures")]
    gif: Option<PathBuf>,
    /// Write a video, `.mp4` or `.webm`; requires the program ffmpeg
    #[arg(long, value_name = "FILE", help_heading = "Pictures")]
    video: Option<PathBuf>,
    /// Write an HTML page that replays the episode; the options below do not apply to it
    #[arg(long, value_name = "FILE", help_heading = "Pictures")]
    html: Option<PathBuf>,
    /// Frame of still pictures: 0 after the reset, 1 after the first step [default: 0 in PNG; SVG is animated]
    #[arg(long, value_name = "N", help_heading = "Pictures")]
    frame: Option<usize>,
    /// Draw the episode as this agent observes it
    #[arg(long, value_name = "AGENT", visible_alias = "view", help_heading = "Pictures")]
    egocentric: Option<usize>,
    /// Leave out the lines between cells
    #[arg(long, help_heading = "Pictures")]
    no_lines: bool,
    /// Write the number of each agent into the agent and its goal
    #[arg(long, help_heading = "Pictures")]
    numbers: bool,
    /// Leave out agents and goals
    #[arg(long, help_heading = "Pictures")]
    no_agents: bool,
    /// Part of the border that is drawn
    #[arg(long, default_value_t, value_parser = word::<Border>(), help_heading = "Pictures")]
    border: Border,
    /// Colours of the agents, repeated in turn, such as `#c1433c,#2e6f9e`
    #[arg(long, value_name = "COLORS", value_delimiter = ',', help_heading = "Pictures")]
    colors: Vec<Color>,
    /// Width of PNG, GIF and video, in pixels [default: such that the longer side is 1024 in PNG, 512 in GIF and 720
    /// in video]
    #[arg(long, value_name = "PX", help_heading = "Pictures")]
    width: Option<u32>,
    /// Steps per second, at most 50 in a GIF [default: 4, in the terminal 8]
    #[arg(long, value_name = "N", help_heading = "Pictures")]
    fps: Option<f64>,
}

impl Pictures {
    /// Returns whether a picture is requested.
    pub fn are_requested(&self) -> bool {
        self.files().next().is_some()
    }

    /// Returns the requested frame.
    pub fn frame(&self) -> Option<usize> {
        self.frame
    }

    /// Returns the requested files, each with its flag.
    fn files(&self) -> impl Iterator<Item = (&str, &Path)> {
        let files = [
            ("--svg", &self.svg),
            ("--png", &self.png),
            ("--gif", &self.gif),
            ("--video", &self.video),
            ("--html", &self.html),
        ];
        files.into_iter().filter_map(|(flag, path)| Some((flag, path.as_deref()?)))
    }

    /// Checks that the requested pictures can be drawn and written, as far as this is known before the episode.
    ///
    /// `inputs` are the files that the command reads, and `others` further files that it writes, with their flags.
    ///
    /// # Errors
    /// If a file cannot be written, is named by two flags or is one of `inputs`; if the video has an unknown format or
    /// ffmpeg is missing; if a value is out of range.
    pub fn check(
        &self,
        num_agents: usize,
        inputs: &[&Path],
        others: &[(&str, &Option<PathBuf>)],
    ) -> Result<(), Error> {
        let others = others.iter().filter_map(|(flag, path)| Some((*flag, path.as_deref()?)));
        check_files(inputs, others.chain(self.files()))?;
        if let Some(path) = &self.video {
            video::VideoFormat::of(path)?;
            video::check_ffmpeg()?;
        }
        if let Some(agent) = self.egocentric.filter(|&agent| agent >= num_agents) {
            return Err(Error::argument(
                "--egocentric",
                agent,
                format!("0 to {}", num_agents.saturating_sub(1)),
            ));
        }
        // In the terminal, values ≤ 0 mean no pauses.
        let has_no_pauses = |fps: f64| fps <= 0.0 && !self.are_requested();
        let (end, of) = match self.gif {
            Some(_) => (gif::MAX_STEPS_PER_SECOND, " for a GIF"),
            None => (*FPS.end(), ""),
        };
        let is_allowed = |fps: &f64| has_no_pauses(*fps) || (*FPS.start()..=end).contains(fps);
        if let Some(fps) = self.fps.filter(|fps| !is_allowed(fps)) {
            // The error shows the value as a user writes it: `0`, `1e300`.
            let shown = format!("{fps:?}");
            let expected = format!("{} to {end}{of}", FPS.start());
            return Err(Error::argument("--fps", shown.trim_end_matches(".0"), expected));
        }
        match self.width {
            Some(0) => Err(Error::argument("--width", 0, "at least 1")),
            _ => Ok(()),
        }
    }

    /// Draws and writes the requested pictures; the replay page shows `title`.
    pub fn draw(&self, trace: &Trace, title: &str) -> Result<(), Error> {
        if let Some(frame) = self.frame {
            trace.state(frame).map_err(flagged("--frame"))?;
        }
        let style = self.style();
        let width = |longer| self.width.unwrap_or_else(|| raster::width_for(trace, &style, longer));
        if let Some(path) = &self.svg {
            files::write(path, svg::draw(trace, &style)?.as_bytes())?;
        }
        if let Some(path) = &self.html {
            files::write(path, html::replay(trace, title)?.as_bytes())?;
        }
        if let Some(path) = &self.png {
            files::write(path, &raster::png(trace, &style, width(raster::LONGER_SIDE))?)?;
        }
        if let Some(path) = &self.gif {
            let bytes = gif::encode(trace, &style, width(LONGER_SIDE_OF_GIF), &mut progress("GIF"))?;
            files::write(path, &bytes)?;
        }
        if let Some(path) = &self.video {
            video::write(trace, &style, width(video::LONGER_SIDE), path, &mut progress("video"))?;
        }
        Ok(())
    }

    /// Returns a screen that shows episodes in the terminal with the options of these flags.
    pub fn screen(&self) -> Screen {
        let style = text::Style { view: self.egocentric, border: self.border, ..text::Style::default() };
        Screen::new(style, self.fps.unwrap_or(TERMINAL_FPS))
    }

    fn style(&self) -> Style {
        let default = Style::default();
        let mut colors = Colors::default();
        if !self.colors.is_empty() {
            colors.agents.clone_from(&self.colors);
        }
        Style {
            static_frame: self.frame,
            egocentric: self.egocentric,
            show_agents: !self.no_agents,
            show_numbers: self.numbers,
            show_lines: !self.no_lines,
            border: self.border,
            step_time: self.fps.map_or(default.step_time, f64::recip),
            colors,
        }
    }
}

/// Returns a callback that shows a progress bar; it takes the number of frames done and the total.
fn progress(what: &'static str) -> impl FnMut(usize, usize) {
    let bar = progress_bar("{msg} {wide_bar} {pos}/{len} frames", 0).with_message(what);
    move |done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
        if done == all {
            bar.finish_and_clear();
        }
    }
}
