//! One episode on the reference engine, measured and, if wanted, recorded.

use pogema_core::{
    Action, CollisionMeter, DensityMeter, Environment, EpisodeMeter, Error, Instance, Metrics, Snapshot,
    StepOut, Trace, TraceHeader, TraceStart, TraceStep,
};
use pogema_maps::{GridConfig, InstanceSource};
use pogema_planners::{NamedPolicy, PomapfObservations};
use pogema_reference::Reference;
use pogema_render::Ground;

pub struct Episode {
    config: GridConfig,
    environment: Reference,
    instance: Instance,
    warnings: Vec<String>,
    meter: EpisodeMeter,
    density: DensityMeter,
    collisions: CollisionMeter,
    metrics: Metrics,
    steps: Vec<TraceStep>,
    start: Option<TraceStart>,
    num_steps: usize,
    is_over: bool,
}

impl Episode {
    /// Makes the instance and resets the engine; `is_recorded` keeps every step for [`Episode::trace`].
    pub fn start(config: GridConfig, is_recorded: bool) -> Result<Self, Error> {
        let generated = InstanceSource::new(config.clone(), None)?.generate()?;
        let mut environment = Reference::new(config.rules())?;
        environment.reset(&generated.instance)?;
        let mut episode = Self {
            meter: EpisodeMeter::new(&config.rules()),
            config,
            instance: generated.instance,
            warnings: generated.warnings,
            density: DensityMeter::default(),
            collisions: CollisionMeter::default(),
            metrics: Metrics::default(),
            steps: Vec::new(),
            start: is_recorded.then(|| TraceStart { state: environment.snapshot(), observations: None }),
            environment,
            num_steps: 0,
            is_over: false,
        };
        episode.density.feed(PomapfObservations::of(&episode.environment)?.counts().into_iter());
        Ok(episode)
    }

    pub fn step(&mut self, actions: Vec<Action>) -> Result<(), Error> {
        let num_agents = self.config.num_agents;
        let (mut rewards, mut terminated, mut truncated) =
            (vec![0.0; num_agents], vec![false; num_agents], vec![false; num_agents]);
        let before = self.environment.snapshot();
        let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
        self.environment.step(&actions, out)?;
        let state = self.environment.snapshot();
        self.num_steps += 1;
        self.density.feed(PomapfObservations::of(&self.environment)?.counts().into_iter());
        self.collisions.feed(self.instance.map(), &before.cells, &before.active, &actions, &state.cells);
        let figures = self.meter.feed(&state.on_goal, &terminated, &truncated);
        self.is_over = figures.is_some();
        self.metrics = Metrics {
            avg_agents_density: Some(self.density.mean()),
            a_collisions: Some(self.collisions.with_agents as f64),
            o_collisions: Some(self.collisions.with_obstacles as f64),
            ..figures.unwrap_or_default()
        };
        if self.start.is_some() {
            let metrics = self.is_over.then_some(self.metrics);
            self.steps.push(TraceStep {
                actions,
                state,
                rewards,
                terminated,
                truncated,
                observations: None,
                metrics,
            });
        }
        Ok(())
    }

    /// Lets a policy choose.
    pub fn ask(&self, policy: &mut NamedPolicy) -> Result<Vec<Action>, Error> {
        policy.act(&self.environment, self.instance.map())
    }

    /// The trace so far, if it is recorded.
    pub fn trace(&self) -> Option<Trace> {
        let start = self.start.clone()?;
        // An agent can reach at most one goal in a step.
        let num_goals = self.num_steps + 1;
        let header = TraceHeader::new(self.config.rules(), &self.instance, num_goals);
        Some(Trace { header, start, steps: self.steps.clone() })
    }

    pub fn snapshot(&self) -> Snapshot {
        self.environment.snapshot()
    }

    /// What there is to draw besides the state.
    pub fn ground(&self) -> Ground<'_> {
        let radius = self.config.rules().radius;
        Ground { map: self.instance.map(), outside: self.instance.outside(), radius }
    }

    pub fn instance(&self) -> &Instance {
        &self.instance
    }

    pub fn config(&self) -> &GridConfig {
        &self.config
    }

    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The figures so far; those of the whole episode once it is over.
    pub fn metrics(&self) -> Metrics {
        self.metrics
    }

    pub fn num_steps(&self) -> usize {
        self.num_steps
    }

    pub fn is_over(&self) -> bool {
        self.is_over
    }
}
