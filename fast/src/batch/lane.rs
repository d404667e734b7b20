//! One environment of a batch, from episode to episode.

use pogema_core::{Action, Config, EpisodeMeter, Error, Instance, Metrics, StepOut};

use crate::{Engine, SimdPath};

use super::Autoreset;
use super::prepare::Preparer;

/// One environment of a batch.
pub struct Lane {
    pub index: usize,
    pub engine: Engine,
    meter: EpisodeMeter,
    /// The number of the present episode.
    pub episode: Option<u64>,
    /// The number of the episode that the preparer is asked for.
    pub wanted: u64,
    /// The instance of the episode before that, if it is here and was not begun yet.
    pub pending: Option<Instance>,
    /// The environment at the end of its last episode, or where its next one lies ready.
    ended: Engine,
    metrics: Option<Metrics>,
    /// Whether an episode ended in the last step.
    pub has_just_ended: bool,
    /// Whether the environment stands at the end of an episode.
    is_over: bool,
    /// Whether the next episode lies ready in `ended`; only then while the episode is over.
    is_laid_out: bool,
    /// Why the lane has no next episode.
    pub failure: Option<Error>,
}

impl Lane {
    pub fn new(index: usize, config: Config, path: SimdPath) -> Result<Self, Error> {
        Ok(Self {
            index,
            engine: Engine::with_path(config, path)?,
            meter: EpisodeMeter::new(&config),
            episode: None,
            wanted: 0,
            pending: None,
            ended: Engine::with_path(config, path)?,
            metrics: None,
            has_just_ended: false,
            is_over: false,
            is_laid_out: false,
            failure: None,
        })
    }

    pub fn step(
        &mut self,
        actions: &[Action],
        out: StepOut<'_>,
        autoreset: Autoreset,
        preparer: &Preparer,
    ) -> Result<(), Error> {
        if self.is_over {
            self.step_after_end(out);
            return Ok(());
        }
        let StepOut { rewards, terminated, truncated } = out;
        pogema_core::Environment::step(
            &mut self.engine,
            actions,
            StepOut { rewards, terminated, truncated },
        )?;
        let metrics = self.meter.feed(self.engine.on_goal(), terminated, truncated);
        self.has_just_ended = metrics.is_some();
        if self.has_just_ended {
            self.metrics = metrics;
            self.is_over = true;
            self.follow(autoreset, preparer);
        }
        Ok(())
    }

    /// Begins the next episode if it lies ready, else leaves the environment as it ended.
    fn step_after_end(&mut self, out: StepOut<'_>) {
        out.rewards.fill(0.0);
        self.has_just_ended = false;
        if self.is_laid_out {
            self.turn();
            out.terminated.fill(false);
            out.truncated.fill(false);
        } else {
            self.engine.terminate(out.terminated);
            self.engine.truncate(out.truncated);
        }
    }

    /// Does after the end of an episode what the batch does by itself.
    fn follow(&mut self, autoreset: Autoreset, preparer: &Preparer) {
        if autoreset == Autoreset::Off {
            return;
        }
        // Made ready within this step even if it begins with the next one, so that a step which has no episode to
        // begin can refuse before anything is played.
        match self.lay_out_next(preparer) {
            Ok(()) if autoreset == Autoreset::SameStep => self.turn(),
            Ok(()) => {}
            Err(error) => self.failure = Some(error),
        }
    }

    fn lay_out_next(&mut self, preparer: &Preparer) -> Result<(), Error> {
        self.look_ahead(preparer)?;
        self.pending.take().map_or(Ok(()), |instance| self.ended.start(instance))?;
        self.is_laid_out = true;
        Ok(())
    }

    /// Takes the episode that lies ready, and puts the ended one aside.
    fn turn(&mut self) {
        std::mem::swap(&mut self.engine, &mut self.ended);
        self.is_laid_out = false;
        self.note_begin();
    }

    fn note_begin(&mut self) {
        self.episode = self.wanted.checked_sub(1);
        self.is_over = false;
    }

    /// Gets the instance of the next episode, unless it is here already.
    pub fn look_ahead(&mut self, preparer: &Preparer) -> Result<(), Error> {
        if self.is_laid_out {
            return Ok(());
        }
        if self.pending.is_none() {
            let taken = preparer.take(self.index);
            self.wanted += u64::from(taken.is_ok());
            preparer.want(self.index, self.wanted);
            self.pending = Some(taken?);
        }
        // INVARIANT: there is one now.
        self.pending.as_ref().map_or(Ok(()), |instance| instance.check_fits(&self.engine.config))
    }

    /// Begins the episode whose instance is here.
    pub fn begin(&mut self) -> Result<(), Error> {
        if self.is_laid_out {
            self.turn();
        } else {
            self.pending.take().map_or(Ok(()), |instance| self.engine.start(instance))?;
            self.note_begin();
        }
        self.meter.reset();
        self.failure = None;
        self.has_just_ended = false;
        Ok(())
    }

    /// Begins episode 0 of another source, whose instance is here.
    pub fn begin_anew(&mut self, instance: Instance, preparer: &Preparer) -> Result<(), Error> {
        self.pending = Some(instance);
        self.is_laid_out = false;
        self.wanted = 1;
        preparer.want(self.index, self.wanted);
        self.begin()
    }

    /// The environment at the end of its last episode, and the episode's figures.
    pub fn ended(&self) -> Option<(&Engine, Metrics)> {
        let engine = if self.is_over { &self.engine } else { &self.ended };
        self.metrics.map(|metrics| (engine, metrics))
    }
}
