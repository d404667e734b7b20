//! A lane: one environment of a batch with its episodes.

use pogema_core::{Action, Config, EpisodeMeter, Error, Instance, Metrics, StepOut};

use crate::{Engine, SimdPath};

use super::Autoreset;
use super::prepare::Preparer;

/// One environment of a batch.
pub struct Lane {
    pub index: usize,
    pub engine: Engine,
    meter: EpisodeMeter,
    /// The number of the current episode.
    pub episode: Option<u64>,
    /// The number of the episode that is requested from the preparer.
    pub requested: u64,
    /// The instance of the episode before the requested one, if that episode has not begun.
    pub pending: Option<Instance>,
    /// The environment at the end of its last episode; if `is_next_ready`, the next episode.
    ended: Engine,
    metrics: Option<Metrics>,
    /// Whether an episode ended in the last step.
    pub has_just_ended: bool,
    /// Whether the current episode has ended.
    is_over: bool,
    /// Whether `ended` holds the next episode. This is only possible after the current episode has ended.
    is_next_ready: bool,
    /// The reason why the lane has no next episode.
    pub failure: Option<Error>,
}

impl Lane {
    pub fn new(index: usize, config: Config, path: SimdPath) -> Result<Self, Error> {
        Ok(Self {
            index,
            engine: Engine::with_path(config, path)?,
            meter: EpisodeMeter::new(&config),
            episode: None,
            requested: 0,
            pending: None,
            ended: Engine::with_path(config, path)?,
            metrics: None,
            has_just_ended: false,
            is_over: false,
            is_next_ready: false,
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
            self.handle_end(autoreset, preparer);
        }
        Ok(())
    }

    /// Returns whether the next step is the last of the episode because of the limit of steps.
    pub fn is_at_limit(&self) -> bool {
        let max_steps = self.engine.config.max_steps;
        !self.is_over && i64::try_from(self.engine.step).is_ok_and(|step| step.saturating_add(1) >= max_steps)
    }

    /// Begins the next episode if it is ready, and otherwise leaves the environment as it ended.
    fn step_after_end(&mut self, out: StepOut<'_>) {
        out.rewards.fill(0.0);
        self.has_just_ended = false;
        if self.is_next_ready {
            self.switch_to_next();
            out.terminated.fill(false);
            out.truncated.fill(false);
        } else {
            self.engine.terminate(out.terminated);
            self.engine.truncate(out.truncated);
        }
    }

    /// Applies the autoreset mode after the end of an episode.
    fn handle_end(&mut self, autoreset: Autoreset, preparer: &Preparer) {
        if autoreset == Autoreset::Off {
            return;
        }
        // The next episode is prepared in this step even if it begins with the next step. If there is none, the next
        // step can therefore fail before any lane plays.
        match self.prepare_next(preparer) {
            Ok(()) if autoreset == Autoreset::SameStep => self.switch_to_next(),
            Ok(()) => {}
            Err(error) => self.failure = Some(error),
        }
    }

    fn prepare_next(&mut self, preparer: &Preparer) -> Result<(), Error> {
        self.fetch_next(preparer)?;
        self.pending.take().map_or(Ok(()), |instance| self.ended.start(instance))?;
        self.is_next_ready = true;
        Ok(())
    }

    /// Switches to the prepared episode, and keeps the ended one.
    fn switch_to_next(&mut self) {
        std::mem::swap(&mut self.engine, &mut self.ended);
        self.is_next_ready = false;
        self.mark_begun();
    }

    fn mark_begun(&mut self) {
        self.episode = self.requested.checked_sub(1);
        self.is_over = false;
    }

    /// Fetches the instance of the next episode, unless the lane already has it.
    pub fn fetch_next(&mut self, preparer: &Preparer) -> Result<(), Error> {
        if self.is_next_ready {
            return Ok(());
        }
        if self.pending.is_none() {
            let taken = preparer.take(self.index);
            self.requested += u64::from(taken.is_ok());
            preparer.request(self.index, self.requested);
            self.pending = Some(taken?);
        }
        // INVARIANT: `pending` holds an instance now.
        self.pending.as_ref().map_or(Ok(()), |instance| instance.check_fits(&self.engine.config))
    }

    /// Begins the next episode. Call [`Lane::fetch_next`] first.
    pub fn begin(&mut self) -> Result<(), Error> {
        if self.is_next_ready {
            self.switch_to_next();
        } else {
            self.pending.take().map_or(Ok(()), |instance| self.engine.start(instance))?;
            self.mark_begun();
        }
        self.meter.reset();
        self.failure = None;
        self.has_just_ended = false;
        Ok(())
    }

    /// Begins episode 0 of another source with its instance.
    pub fn begin_with(&mut self, instance: Instance, preparer: &Preparer) -> Result<(), Error> {
        self.pending = Some(instance);
        self.is_next_ready = false;
        self.requested = 1;
        preparer.request(self.index, self.requested);
        self.begin()
    }

    /// Returns the environment at the end of the last ended episode, and the metrics of the episode.
    pub fn ended(&self) -> Option<(&Engine, Metrics)> {
        let engine = if self.is_over { &self.engine } else { &self.ended };
        self.metrics.map(|metrics| (engine, metrics))
    }
}
