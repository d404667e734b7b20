//! Pictures and videos of every N-th episode of one environment, made on a thread of their own.
//!
//! While an episode is filmed, only the actions of its environment are kept. The thread then plays the episode again as
//! an [`Episode`], which an instance and actions determine, and draws its trace.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

use pogema::{EnvSource, Instances};
use pogema_core::{Action, Config, Environment, Episode, Error, Trace, files, words};
use pogema_fast::{Batch, Engine};
use pogema_render::{Style, html, raster, svg, video};

/// Largest number of episodes that wait to be drawn. If the queue is full, the end of a filmed episode blocks.
const MAX_WAITING: usize = 16;

words! {
    /// The format of a film, named after its file extension.
    pub enum Format {
        /// An animated picture.
        Svg = "svg",
        /// A page that replays the episode.
        Html = "html",
        /// A video, encoded by the program ffmpeg.
        Mp4 = "mp4",
    }
}

/// Films every N-th episode of one environment of a batch.
pub struct Film {
    plan: Plan,
    /// Number of episodes that the environment has begun.
    num_begun: u64,
    /// The number that the batch gives to the current episode.
    episode: Option<u64>,
    take: Option<Take>,
    takes: Option<SyncSender<Take>>,
    thread: Option<JoinHandle<()>>,
    results: Arc<Mutex<Results>>,
}

/// The episodes to film and the names of their files: `prefix`, the number of the episode, and the format.
pub struct Plan {
    pub env: usize,
    pub every: u64,
    pub prefix: PathBuf,
    pub format: Format,
}

/// The finished files, and the reasons why others are missing, in the order of the episodes.
#[derive(Default)]
pub struct Results {
    pub files: Vec<PathBuf>,
    pub failures: Vec<String>,
}

/// A filmed episode so far.
struct Take {
    /// The number in the name of the file.
    number: u64,
    source: EnvSource,
    env: usize,
    episode: u64,
    config: Config,
    actions: Vec<Action>,
    path: PathBuf,
    format: Format,
}

impl Film {
    /// Starts the thread that draws.
    ///
    /// # Errors
    /// If a video needs ffmpeg and it is missing, or the thread cannot be started.
    pub fn new(plan: Plan) -> Result<Self, Error> {
        if plan.format == Format::Mp4 {
            video::check_ffmpeg()?;
        }
        let results = Arc::new(Mutex::new(Results::default()));
        let (takes, waiting) = sync_channel::<Take>(MAX_WAITING);
        let theirs = Arc::clone(&results);
        let thread = Builder::new().name("pogema film".into()).spawn(move || {
            for take in waiting {
                let drawn = draw_caught(&take);
                let mut results = lock(&theirs);
                match drawn {
                    Ok(()) => results.files.push(take.path),
                    Err(reason) => results.failures.push(reason),
                }
            }
        });
        let thread = thread.map_err(|error| Error::external("thread that draws films", error))?;
        let (takes, thread) = (Some(takes), Some(thread));
        Ok(Self { plan, num_begun: 0, episode: None, take: None, takes, thread, results })
    }

    /// Continues after a reset, which cuts off the current episode of each chosen environment.
    pub fn follow_reset(&mut self, chosen: &[bool], batch: &Batch, source: &EnvSource) -> Result<(), Error> {
        if chosen.get(self.plan.env).copied().unwrap_or_default() {
            self.finish();
            self.begin(batch, source)?;
        }
        Ok(())
    }

    /// Continues after a step with the actions of all environments.
    pub fn follow_step(
        &mut self,
        actions: &[Action],
        batch: &Batch,
        source: &EnvSource,
    ) -> Result<(), Error> {
        let env = self.plan.env;
        if let Some(take) = &mut self.take {
            let first = env * batch.config().num_agents;
            take.actions.extend_from_slice(&actions[first..first + take.config.num_agents]);
        }
        if batch.has_just_ended(env)? {
            self.finish();
        }
        if batch.episode(env)? != self.episode {
            self.begin(batch, source)?;
        }
        Ok(())
    }

    /// Locks the results so far.
    pub fn results(&self) -> MutexGuard<'_, Results> {
        lock(&self.results)
    }

    /// Finishes the current episode as it is, and waits until all films are drawn.
    pub fn close(&mut self) {
        self.finish();
        self.takes = None;
        if let Some(thread) = self.thread.take() {
            // INVARIANT: the thread catches panics of the drawing code and does not panic otherwise.
            let _ = thread.join();
        }
    }

    fn begin(&mut self, batch: &Batch, source: &EnvSource) -> Result<(), Error> {
        let Plan { env, every, prefix, format } = &self.plan;
        self.episode = batch.episode(*env)?;
        let number = self.num_begun;
        self.num_begun += 1;
        let Some(episode) = self.episode.filter(|_| number.is_multiple_of(*every)) else { return Ok(()) };
        let mut name = prefix.clone().into_os_string();
        name.push(format!("{number}.{format}"));
        let config = *batch.lane(*env)?.config();
        let (source, actions, path) = (source.clone(), Vec::new(), PathBuf::from(name));
        self.take = Some(Take { number, source, env: *env, episode, config, actions, path, format: *format });
        Ok(())
    }

    /// Passes the current episode to the thread, if it is filmed and has steps.
    fn finish(&mut self) {
        let take = self.take.take().filter(|take| !take.actions.is_empty());
        if let (Some(take), Some(takes)) = (take, &self.takes) {
            // INVARIANT: the thread receives until the channel closes.
            let _ = takes.send(take);
        }
    }
}

impl Drop for Film {
    fn drop(&mut self) {
        self.close();
    }
}

impl Take {
    fn trace(&self) -> Result<Trace, Error> {
        let mut episode = Episode::new(Engine::new(self.config)?).with_recording();
        episode.start(self.source.instance(self.env, self.episode)?)?;
        for actions in self.actions.chunks_exact(self.config.num_agents) {
            let active = episode.state().active;
            let actions = actions.iter().zip(active);
            // The environment ignores the actions of finished agents, so the picture shows none.
            let actions: Vec<_> =
                actions.map(|(&action, &active)| if active { action } else { Action::Stay }).collect();
            episode.step(&actions)?;
        }
        episode.trace()
    }

    fn draw(&self) -> Result<(), Error> {
        let (trace, style, path) = (self.trace()?, Style::default(), &*self.path);
        match self.format {
            Format::Svg => files::write_whole(path, svg::draw(&trace, &style)?.as_bytes()),
            Format::Html => files::write_whole(path, html::replay(&trace, &title(path))?.as_bytes()),
            Format::Mp4 => {
                let width = raster::width_for(&trace, &style, video::LONGER_SIDE);
                video::write(&trace, &style, width, path, &mut |_, _| ())
            }
        }
    }
}

fn title(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Draws a film and returns the reason if the drawing fails or panics.
fn draw_caught(take: &Take) -> Result<(), String> {
    let drawn = catch_unwind(AssertUnwindSafe(|| take.draw()));
    let drawn = drawn.unwrap_or_else(|panic: Box<dyn Any + Send>| {
        Err(Error::external("film", crate::guard::text(&*panic)))
    });
    drawn.map_err(|error| format!("the film of episode {} is missing: {error}", take.number))
}

fn lock(results: &Mutex<Results>) -> MutexGuard<'_, Results> {
    results.lock().unwrap_or_else(PoisonError::into_inner)
}
