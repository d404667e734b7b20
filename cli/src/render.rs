//! `pogema render`: pictures of a recorded episode.

mod pictures;
mod screen;

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use pogema_conformance::files;
use pogema_core::{Error, Trace, shorten};
use pogema_render::Film;

pub use pictures::Pictures;

#[derive(Args, Debug)]
pub struct Render {
    /// What `pogema run --trace` wrote
    trace: PathBuf,
    /// Play the episode in the terminal, as happens if no file is asked for
    #[arg(long)]
    text: bool,
    /// The part from one step to another, such as `10..20`; `--frame` then counts from its beginning
    #[arg(long, value_name = "A..B")]
    steps: Option<Steps>,
    #[command(flatten)]
    pictures: Pictures,
}

/// Two frames and all between them.
#[derive(Clone, Copy, Debug)]
struct Steps {
    first: usize,
    last: usize,
}

impl FromStr for Steps {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let ends =
            text.split_once("..").and_then(|(first, last)| Some((first.parse().ok()?, last.parse().ok()?)));
        let steps = ends.filter(|(first, last)| first <= last).map(|(first, last)| Self { first, last });
        steps.ok_or_else(|| {
            let found = shorten(text, Error::LONGEST_QUOTE);
            Error::State { reason: format!("found `{found}`, expected two steps such as `10..20`") }
        })
    }
}

impl Render {
    pub fn run(&self) -> Result<(), Error> {
        let trace = Trace::read(files::open(&self.trace)?).map_err(|error| Error::io(&self.trace, error))?;
        let mut film = Film::of(&trace);
        film.check().map_err(|error| Error::io(&self.trace, error))?;
        self.pictures.check(film.config.num_agents)?;
        if let Some(Steps { first, last }) = self.steps {
            film = film.part(first..=last)?;
        }
        let name = self.trace.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if self.text || !self.pictures.are_wanted() {
            self.play(&film)?;
        }
        self.pictures.draw(&film, &name)
    }

    fn play(&self, film: &Film) -> Result<(), Error> {
        let mut screen = self.pictures.screen();
        match self.pictures.frame() {
            Some(frame) => screen.draw(film.ground(), film.state(frame)?),
            None => film.states().try_for_each(|state| screen.draw(film.ground(), state)),
        }
    }
}
