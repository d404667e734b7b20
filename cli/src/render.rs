//! `pogema render`: draws a recorded episode.

mod pictures;
mod screen;

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use pogema_conformance::files;
use pogema_core::{Error, Trace, shorten};
use pogema_render::{Ground, check};

use crate::input::Input;
use crate::output::{flagged, is_closed};

pub use pictures::Pictures;

#[derive(Args, Debug)]
pub struct Render {
    /// Trace, as `pogema run --trace` writes it
    trace: PathBuf,
    /// Play the episode in the terminal [default if no picture is requested]
    #[arg(long)]
    text: bool,
    /// Draw only the frames A to B, both included, such as `10..20`; `--frame` then counts from A [default: all]
    #[arg(long, value_name = "A..B")]
    steps: Option<FrameRange>,
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    pictures: Pictures,
}

/// A range of frames; both ends are included.
#[derive(Clone, Copy, Debug)]
struct FrameRange {
    first: usize,
    last: usize,
}

impl FromStr for FrameRange {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let ends =
            text.split_once("..").and_then(|(first, last)| Some((first.parse().ok()?, last.parse().ok()?)));
        let steps = ends.filter(|(first, last)| first <= last).map(|(first, last)| Self { first, last });
        steps.ok_or_else(|| {
            let found = shorten(text, Error::LONGEST_QUOTE);
            Error::request(format!("found `{found}`, expected `A..B` with A at most B, such as `10..20`"))
        })
    }
}

impl Render {
    pub fn run(&self) -> Result<(), Error> {
        let file = files::open_within(&self.trace, self.input.limit())?;
        let trace = Trace::read(file).map_err(|error| Error::io(&self.trace, error))?;
        check(&trace).map_err(|error| Error::io(&self.trace, error))?;
        self.pictures.check(trace.header.config.num_agents, &[&self.trace], &[])?;
        let (first, trace) = match self.steps {
            Some(FrameRange { first, last }) => {
                (first, trace.part(first..=last).map_err(flagged("--steps"))?)
            }
            None => (0, trace),
        };
        let name = self.trace.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        self.pictures.draw(&trace, &name)?;
        if self.text || !self.pictures.are_requested() { self.play(&trace, first) } else { Ok(()) }
    }

    /// Plays an episode in the terminal, or shows one frame of it; frame 0 is the state after `first` steps.
    fn play(&self, trace: &Trace, first: usize) -> Result<(), Error> {
        let (mut screen, ground) = (self.pictures.screen(), Ground::of(trace));
        if let Some(frame) = self.pictures.frame() {
            let state = trace.state(frame).map_err(flagged("--frame"))?;
            return screen.draw(ground, first + frame, state);
        }
        let mut states = (first..).zip(trace.states()).take_while(|_| !is_closed());
        states.try_for_each(|(step, state)| screen.draw(ground, step, state))
    }
}
