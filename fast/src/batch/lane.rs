//! A lane: one environment of a batch with its episodes.

use pogema_core::{Action, Config, EpisodeMeter, Error, Instance, Metrics, StepOut};

use crate::{Engine, SimdPath};

use super::Autoreset;
use super::prepare::{Instances, Preparer, make};

/// One environment of a batch.
pub struct Lane {
    pub index: usize,
    /// The config of the batch. Its number of agents is the maximum for each episode.
    config: Config,
    pub engine: Engine,
    meter: EpisodeMeter,
    /// The number of the current episode.
    pub episode: Option<u64>,
    /// How many episodes the lane has begun.
    pub num_begun: u64,
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
    pub is_over: bool,
    /// Whether `ended` holds the next episode. This is only possible after the current episode has ended.
    is_next_ready: bool,
    /// The reason why the lane has no next episode.
    pub failure: Option<Error>,
}

impl Lane {
    pub fn new(index: usize, config: Config, path: SimdPath) -> Result<Self, Error> {
        Ok(Self {
            index,
            config,
            engine: Engine::with_path(config, path)?,
            meter: EpisodeMeter::new(&config),
            episode: None,
            num_begun: 0,
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

    /// Plays a step of the lane's agents. In the rows of padding, rewards are 0, and `terminated`
    /// and `truncated` are true.
    pub fn step(
        &mut self,
        actions: &[Action],
        out: StepOut<'_>,
        autoreset: Autoreset,
        preparer: &Preparer,
    ) -> Result<(), Error> {
        let was_over = self.is_over;
        if self.is_next_ready {
            self.switch_to_next();
        }
        let num_agents = self.engine.config.num_agents;
        let (out, padding) = out.split_at(num_agents);
        padding.rewards.fill(0.0);
        padding.terminated.fill(true);
        padding.truncated.fill(true);
        if was_over {
            self.skip_step(out);
            return Ok(());
        }
        let StepOut { rewards, terminated, truncated } = out;
        pogema_core::Environment::step(
            &mut self.engine,
            &actions[..num_agents],
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

    /// Returns the environment that the next step plays. If an episode begins with that step, the step only observes
    /// the environment.
    pub fn next_engine(&self) -> &Engine {
        if self.is_next_ready { &self.ended } else { &self.engine }
    }

    /// Returns whether the next step is the last of the episode because of the step limit.
    pub fn is_at_limit(&self) -> bool {
        let max_steps = self.engine.config.max_steps;
        !self.is_over && i64::try_from(self.engine.step).is_ok_and(|step| step.saturating_add(1) >= max_steps)
    }

    /// Writes the results of a step that plays nothing, because the episode has just begun or has ended.
    fn skip_step(&mut self, out: StepOut<'_>) {
        out.rewards.fill(0.0);
        self.has_just_ended = false;
        if self.is_over {
            self.engine.terminate(out.terminated);
            self.engine.truncate(out.truncated);
        } else {
            out.terminated.fill(false);
            out.truncated.fill(false);
        }
    }

    /// Applies the autoreset mode after the end of an episode.
    fn handle_end(&mut self, autoreset: Autoreset, preparer: &Preparer) {
        if autoreset == Autoreset::Off {
            return;
        }
        // The next episode is prepared in this step even if it begins with the next step. If the lane has no next
        // episode, the next step can therefore fail before any lane plays.
        match self.prepare_next(preparer) {
            Ok(()) if autoreset == Autoreset::SameStep => self.switch_to_next(),
            Ok(()) => {}
            Err(error) => self.failure = Some(error),
        }
    }

    fn prepare_next(&mut self, preparer: &Preparer) -> Result<(), Error> {
        self.fetch_next(preparer)?;
        self.start_next()
    }

    /// Starts the next episode in the engine that is not playing.
    fn start_next(&mut self) -> Result<(), Error> {
        self.ended.start_resized(&mut self.pending)?;
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
        self.num_begun += 1;
        self.is_over = false;
        if self.meter.num_agents() != self.engine.config.num_agents {
            self.meter = EpisodeMeter::new(&self.engine.config);
        }
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
        self.pending.as_ref().map_or(Ok(()), |instance| self.check_fits(instance))
    }

    /// Begins the next episode. Call [`Lane::fetch_next`] first.
    pub fn begin(&mut self) -> Result<(), Error> {
        if self.is_over && !self.is_next_ready {
            // `engine` holds the ended episode, which stays readable.
            self.start_next()?;
        }
        if self.is_next_ready {
            self.switch_to_next();
        } else {
            self.engine.start_resized(&mut self.pending)?;
            self.mark_begun();
        }
        self.meter.reset();
        self.failure = None;
        self.has_just_ended = false;
        Ok(())
    }

    /// Returns the instance of the lane's next episode from another source, if that episode is ready to begin.
    pub fn next_instance_of(&self, source: &dyn Instances) -> Result<Option<Instance>, Error> {
        if !self.is_next_ready {
            return Ok(None);
        }
        let instance = make(source, self.index, self.requested - 1)?;
        self.check_fits(&instance)?;
        Ok(Some(instance))
    }

    /// Continues with the episodes of another source. The preparer already has this source. `next` is the result of
    /// [`Lane::next_instance_of`].
    pub fn change_source(&mut self, mut next: Option<Instance>, preparer: &Preparer) -> Result<(), Error> {
        self.requested -= u64::from(self.pending.take().is_some());
        preparer.request(self.index, self.requested);
        let started = self.ended.start_resized(&mut next);
        if let Err(error) = &started {
            self.is_next_ready = false;
            self.pending = next;
            self.failure = Some(error.clone());
        }
        started
    }

    /// Checks that an instance has at most as many agents as the config, and fits the config in all other respects.
    pub fn check_fits(&self, instance: &Instance) -> Result<(), Error> {
        let num_agents = instance.starts().len().clamp(1, self.config.num_agents);
        instance.check_fits(&Config { num_agents, ..self.config })
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
