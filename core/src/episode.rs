//! An episode: plays the steps of an engine, and measures and records them.

use serde::{Deserialize, Serialize};

use crate::metrics::{CollisionMeter, DensityMeter, EpisodeMeter, Metrics, Seen};
use crate::{
    Action, Cell, Config, Environment, Error, Instance, OnGoal, Snapshot, State, StepResults, Trace,
    TraceHeader, TraceStart, TraceStep,
};

/// An engine with the instance that it plays, the results of the last step, the meters and, on request, a recording.
///
/// Further steps after the end are allowed (rule: end/after). An `Err` leaves the episode unchanged.
///
/// ```
/// # use pogema_core::{Config, Environment, Episode, Error, Instance};
/// fn wait<E: Environment>(engine: E, instance: Instance) -> Result<f64, Error> {
///     let mut episode = Episode::new(engine).with_collisions();
///     episode.start(instance)?;
///     while !episode.is_over() {
///         episode.step(&vec![pogema_core::Action::Stay; episode.config().num_agents])?;
///     }
///     Ok(episode.metrics().a_collisions.unwrap_or_default())
/// }
/// ```
#[derive(Clone, Debug)]
pub struct Episode<E> {
    engine: E,
    instance: Option<Instance>,
    num_steps: u64,
    results: StepResults,
    meters: Meters,
    /// The metrics of the episode if the last step ended it.
    final_metrics: Option<Metrics>,
    /// All states since the reset if the config keeps them.
    past: Vec<Snapshot>,
    is_recorded: bool,
    recording: Option<Recording>,
    scratch: Scratch,
}

/// The meters of an episode.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Meters {
    /// The metrics of POGEMA itself.
    pub episode: EpisodeMeter,
    /// The density of agents, if it is measured.
    pub density: Option<DensityMeter>,
    /// The reverted moves, if they are counted.
    pub collisions: Option<CollisionMeter>,
}

/// The states and steps of an episode so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recording {
    /// The state after the reset.
    pub start: Snapshot,
    /// Every step, undone steps excluded.
    pub steps: Vec<TraceStep>,
}

impl Recording {
    /// Returns the state after the reset and after each step.
    fn states(&self) -> impl Iterator<Item = &Snapshot> {
        std::iter::once(&self.start).chain(self.steps.iter().map(|step| &step.state))
    }

    /// Returns the goals of an agent in lifelong mode: the first one, and the one after each goal that was reached.
    fn goals_of(&self, agent: usize) -> Vec<Cell> {
        let reached = self.steps.iter().map(|step| &step.state).filter(|state| state.on_goal[agent]);
        std::iter::once(&self.start).chain(reached).map(|state| state.goals[agent]).collect()
    }
}

/// Buffers that are reused in every step to avoid allocations.
#[derive(Clone, Debug, Default)]
struct Scratch {
    cells: Vec<Cell>,
    active: Vec<bool>,
    seen: Vec<Seen>,
}

impl Meters {
    fn reset(&mut self) {
        self.episode.reset();
        if let Some(density) = &mut self.density {
            density.reset();
        }
        if let Some(collisions) = &mut self.collisions {
            *collisions = CollisionMeter::default();
        }
    }
}

impl<E: Environment> Episode<E> {
    /// Creates an episode that has not started, measures only POGEMA's own metrics and records nothing.
    pub fn new(engine: E) -> Self {
        let config = *engine.config();
        Self {
            engine,
            instance: None,
            num_steps: 0,
            results: StepResults::new(config.num_agents),
            meters: Meters { episode: EpisodeMeter::new(&config), density: None, collisions: None },
            final_metrics: None,
            past: Vec::new(),
            is_recorded: false,
            recording: None,
            scratch: Scratch::default(),
        }
    }

    /// Also measures the density of agents.
    ///
    /// Rule: metrics/density
    #[must_use]
    pub fn with_density(mut self) -> Self {
        self.meters.density = Some(DensityMeter::default());
        self
    }

    /// Also counts reverted moves.
    ///
    /// Rule: metrics/collisions
    #[must_use]
    pub fn with_collisions(mut self) -> Self {
        self.meters.collisions = Some(CollisionMeter::default());
        self
    }

    /// Also records every step, for [`Episode::trace`].
    #[must_use]
    pub fn with_recording(mut self) -> Self {
        self.is_recorded = true;
        self
    }

    /// Sets whether episodes are recorded, from the next start on.
    pub fn record(&mut self, is_recorded: bool) {
        self.is_recorded = is_recorded;
    }

    /// Starts the episode, or the next one.
    ///
    /// # Errors
    /// If the instance does not fit the config.
    pub fn start(&mut self, instance: Instance) -> Result<(), Error> {
        self.engine.reset(&instance)?;
        self.instance = Some(instance);
        self.num_steps = 0;
        self.final_metrics = None;
        self.meters.reset();
        self.feed_density()?;
        let is_kept = self.config().persistent;
        self.past = if is_kept { vec![self.engine.snapshot()] } else { Vec::new() };
        let recording = || Recording { start: self.engine.snapshot(), steps: Vec::new() };
        self.recording = self.is_recorded.then(recording);
        Ok(())
    }

    /// Continues an episode whose engine is already in the right state. `past` holds the kept states.
    ///
    /// The meters and the results of the last step stay as they are.
    ///
    /// # Errors
    /// [`Error::ForeignState`] if a state does not fit the instance, or if `past` has the wrong length: with
    /// `persistent` in the config, it must hold the states after the start and after each step, otherwise none.
    pub fn resume(
        &mut self,
        instance: Instance,
        num_steps: u64,
        past: Vec<Snapshot>,
        recording: Option<Recording>,
    ) -> Result<(), Error> {
        let size = (instance.map().height(), instance.map().width());
        let recorded = recording.iter().flat_map(Recording::states);
        past.iter().chain(recorded).try_for_each(|state| state.check_fits(self.config().num_agents, size))?;
        let num_kept = if self.config().persistent { num_steps.checked_add(1) } else { Some(0) };
        if num_kept != Some(past.len() as u64) {
            return Err(Error::ForeignState);
        }
        self.instance = Some(instance);
        self.num_steps = num_steps;
        self.past = past;
        self.recording = recording;
        Ok(())
    }

    /// Plays one step.
    ///
    /// # Errors
    /// Before the start, or for an action list of the wrong length.
    pub fn step(&mut self, actions: &[Action]) -> Result<(), Error> {
        if self.instance.is_none() {
            return Err(Error::NotReset);
        }
        if self.meters.collisions.is_some() {
            let State { cells, active, .. } = self.engine.state();
            self.scratch.cells.clear();
            self.scratch.cells.extend_from_slice(cells);
            self.scratch.active.clear();
            self.scratch.active.extend_from_slice(active);
        }
        self.engine.step(actions, self.results.out())?;
        self.num_steps += 1;
        self.measure(actions)?;
        if self.config().persistent {
            self.past.push(self.engine.snapshot());
        }
        if self.recording.is_some() {
            self.keep(actions);
        }
        Ok(())
    }

    fn measure(&mut self, actions: &[Action]) -> Result<(), Error> {
        let state = self.engine.state();
        if let (Some(collisions), Some(instance)) = (&mut self.meters.collisions, &self.instance) {
            let Scratch { cells, active, .. } = &self.scratch;
            collisions.feed(instance.map(), cells, active, actions, state.cells);
        }
        self.final_metrics =
            self.meters.episode.feed(state.on_goal, &self.results.terminated, &self.results.truncated);
        self.feed_density()
    }

    fn feed_density(&mut self) -> Result<(), Error> {
        if let Some(density) = &mut self.meters.density {
            self.engine.count_seen(&mut self.scratch.seen)?;
            density.feed(&self.scratch.seen);
        }
        Ok(())
    }

    fn keep(&mut self, actions: &[Action]) {
        let StepResults { rewards, terminated, truncated } = self.results.clone();
        let step = TraceStep {
            actions: actions.to_vec(),
            state: self.engine.snapshot(),
            rewards,
            terminated,
            truncated,
            observations: None,
            metrics: self.is_over().then(|| self.metrics()),
        };
        if let Some(recording) = &mut self.recording {
            recording.steps.push(step);
        }
    }

    /// Undoes the last step and returns whether there was one.
    ///
    /// Requires `persistent` in the config. The metrics, the results and [`Episode::is_over`] still
    /// include the undone step.
    ///
    /// # Errors
    /// Before the start, or [`Error::StepsNotKept`].
    ///
    /// Rule: history/step-back
    ///
    /// Source: POGEMA 1.4.0, `wrappers/persistence.py`, `PersistentWrapper.step_back`
    pub fn step_back(&mut self) -> Result<bool, Error> {
        if self.instance.is_none() {
            return Err(Error::NotReset);
        }
        if !self.config().persistent {
            return Err(Error::StepsNotKept);
        }
        let [.., before, _] = &self.past[..] else { return Ok(false) };
        self.engine.restore(self.num_steps - 1, before)?;
        self.past.pop();
        self.num_steps -= 1;
        if let Some(recording) = &mut self.recording {
            recording.steps.pop();
        }
        Ok(true)
    }

    /// Returns the engine.
    pub fn engine(&self) -> &E {
        &self.engine
    }

    /// Returns the engine mutably, to change its state between steps.
    pub fn engine_mut(&mut self) -> &mut E {
        &mut self.engine
    }

    /// Returns the rules and sizes.
    pub fn config(&self) -> &Config {
        self.engine.config()
    }

    /// Returns the instance that is played.
    ///
    /// # Errors
    /// [`Error::NotReset`] before the start.
    pub fn instance(&self) -> Result<&Instance, Error> {
        self.instance.as_ref().ok_or(Error::NotReset)
    }

    /// Returns the number of steps since the start, undone steps excluded.
    pub fn num_steps(&self) -> u64 {
        self.num_steps
    }

    /// Returns the state of all agents.
    pub fn state(&self) -> State<'_> {
        self.engine.state()
    }

    /// Returns a copy of the visible state.
    pub fn snapshot(&self) -> Snapshot {
        self.engine.snapshot()
    }

    /// Returns the rewards of the last step.
    pub fn rewards(&self) -> &[f32] {
        &self.results.rewards
    }

    /// Returns which agents are terminated after the last step, those terminated earlier included.
    pub fn terminated(&self) -> &[bool] {
        &self.results.terminated
    }

    /// Returns which agents are truncated after the last step.
    pub fn truncated(&self) -> &[bool] {
        &self.results.truncated
    }

    /// Returns whether the last step ended the episode: all agents are terminated, or all are truncated.
    pub fn is_over(&self) -> bool {
        self.final_metrics.is_some()
    }

    /// Returns the metrics so far.
    ///
    /// POGEMA's own metrics are present if the last step ended the episode and the config keeps no steps. The other
    /// metrics are present if they are measured.
    pub fn metrics(&self) -> Metrics {
        let Meters { density, collisions, .. } = &self.meters;
        let counted = collisions.map(|meter| (meter.with_agents as f64, meter.with_obstacles as f64));
        let (a_collisions, o_collisions) = counted.unzip();
        let avg_agents_density = density.as_ref().map(DensityMeter::mean);
        let own = self.final_metrics.filter(|_| !self.config().persistent).unwrap_or_default();
        Metrics { avg_agents_density, a_collisions, o_collisions, ..own }
    }

    /// Returns the meters.
    pub fn meters(&self) -> &Meters {
        &self.meters
    }

    /// Returns the meters mutably, to choose the metrics before the next start or to load a saved state.
    pub fn meters_mut(&mut self) -> &mut Meters {
        &mut self.meters
    }

    /// Returns all states since the start; the list is empty unless the config keeps them.
    ///
    /// Rule: history/changes
    pub fn past(&self) -> &[Snapshot] {
        &self.past
    }

    /// Returns the recording so far, if the episode is recorded.
    pub fn recording(&self) -> Option<&Recording> {
        self.recording.as_ref()
    }

    /// Returns the episode so far as a trace.
    ///
    /// # Errors
    /// [`Error::NotRecorded`] unless the episode is recorded.
    pub fn trace(&self) -> Result<Trace, Error> {
        let (Some(instance), Some(recording)) = (&self.instance, &self.recording) else {
            return Err(Error::NotRecorded);
        };
        // An agent gets further goals only in lifelong mode, at most one in a step.
        let num_goals = match self.config().on_goal {
            OnGoal::Restart => recording.steps.len() + 1,
            OnGoal::Finish | OnGoal::Nothing => 1,
        };
        let mut header = TraceHeader::new(*self.config(), instance, num_goals);
        if self.config().on_goal == OnGoal::Restart {
            // Undoing a step does not move the goal streams back, so the recorded steps may have later goals.
            for (agent, listed) in header.goals.iter_mut().enumerate() {
                let used = recording.goals_of(agent);
                if !listed.starts_with(&used) {
                    *listed = used;
                }
            }
        }
        let start = TraceStart { state: recording.start.clone(), observations: None };
        Ok(Trace { header, start, steps: recording.steps.clone() })
    }
}
