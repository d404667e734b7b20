//! The answers of the engines of this workspace to a request.

use pogema_core::{
    Action, Change, Config, Environment, Episode, Error, Instance, Metrics, Observation, Observed,
    ObservedMapf, ObservedPomapf, OnGoal, Outside, Padded, Snapshot, TraceStep, changes, from_border,
    states_at_every_step,
};
use pogema_maps::{GridConfig, InstanceSource, foretold_goals};
use pogema_numpy::Generator;
use pogema_planners::{AStarTeam, PomapfObservations, pogema_team, sample};

use crate::digits::pack;
use crate::request::{
    Back, Derived, Failure, History, Op, Record, Request, ResetRecord, Response, StepRecord, When,
    actions_of, padded_dtype,
};

/// Maximum episode length for which goals are foretold. The oracle has the same limit.
const MAX_FORETOLD_STEPS: i64 = 4096;

/// An engine and its name.
#[derive(Clone, Copy, Debug)]
pub struct NamedEngine {
    /// The name in reports.
    pub name: &'static str,
    /// Creates an environment of the engine.
    pub make: fn(Config) -> Result<Box<dyn Environment>, Error>,
}

impl NamedEngine {
    /// The reference engine.
    pub const REFERENCE: Self =
        Self { name: "reference", make: |config| Ok(Box::new(pogema_reference::Reference::new(config)?)) };
    /// The engine that follows POGEMA's procedures step for step.
    pub const LITERAL: Self =
        Self { name: "literal", make: |config| Ok(Box::new(crate::Literal::new(config)?)) };
}

/// A function that creates an environment for a config.
pub type Make<'a> = dyn Fn(Config) -> Result<Box<dyn Environment>, Error> + Send + 'a;

/// Plays a request on the reference engine.
pub fn play(request: &Request) -> Response {
    play_on(NamedEngine::REFERENCE, request)
}

/// Plays a request on an engine.
pub fn play_on(engine: NamedEngine, request: &Request) -> Response {
    let mut response = Response::to(request);
    match Player::new(&engine.make, request) {
        Ok(mut player) => {
            response.record(request, |_, op| player.perform(op));
            response.warnings = player.warnings;
        }
        Err(error) => response.error = Some(Failure::new(When::Phase("config".into()), &error)),
    }
    response
}

/// The source of the instances of the episodes.
enum Source {
    Drawn(Box<InstanceSource>),
    Given(Box<Instance>),
}

impl Source {
    fn next(&mut self) -> Result<(Instance, Vec<String>), Error> {
        match self {
            Self::Drawn(source) => source.generate().map(|drawn| (drawn.instance, drawn.warnings)),
            Self::Given(instance) => Ok((instance.as_ref().clone(), Vec::new())),
        }
    }
}

/// The optional metrics to measure.
#[derive(Clone, Copy)]
pub(crate) struct Measured {
    pub density: bool,
    pub collisions: bool,
}

impl Measured {
    pub fn of(metric_names: &[String]) -> Self {
        let has = |name: &str| metric_names.iter().any(|metric| metric == name);
        Self { density: has("avg_agents_density"), collisions: has("a_collisions") || has("o_collisions") }
    }
}

/// The state of a request that is being played.
pub(crate) struct Player {
    pub(crate) config: GridConfig,
    source: Source,
    pub(crate) episode: Episode<Box<dyn Environment>>,
    warnings: Vec<String>,
    /// The states so far, for the operation `history`.
    past: Vec<Snapshot>,
    team: AStarTeam,
    sampler: Generator,
    padded: Option<Padded>,
}

impl Player {
    pub(crate) fn new(make: &Make<'_>, request: &Request) -> Result<Self, Error> {
        let config = GridConfig::from_value(&request.config)?;
        let source = Source::Drawn(Box::new(request.source(&config)?));
        let measured = Measured { density: request.density, collisions: request.collisions };
        Self::with_source(make, config, source, measured)
    }

    /// Creates a player whose episodes all begin from one instance. It measures the named optional metrics.
    pub(crate) fn of_instance(
        make: &Make<'_>,
        rules: &Config,
        instance: Instance,
        metric_names: &[String],
    ) -> Result<Self, Error> {
        let config = GridConfig {
            num_agents: rules.num_agents,
            obs_radius: rules.radius,
            max_episode_steps: rules.max_steps,
            collision_system: rules.collision,
            on_target: rules.on_goal,
            observation_type: rules.observation,
            occupancy: rules.occupancy,
            reward: rules.reward,
            persistent: rules.persistent,
            empty_outside: matches!(instance.outside(), Outside::Free),
            ..GridConfig::default()
        };
        Self::with_source(make, config, Source::Given(Box::new(instance)), Measured::of(metric_names))
    }

    fn with_source(
        make: &Make<'_>,
        config: GridConfig,
        source: Source,
        measured: Measured,
    ) -> Result<Self, Error> {
        let mut episode = Episode::new(make(config.rules())?);
        if measured.density {
            episode = episode.with_density();
        }
        if measured.collisions {
            episode = episode.with_collisions();
        }
        Ok(Self {
            source,
            episode,
            warnings: Vec::new(),
            past: Vec::new(),
            team: pogema_team(),
            sampler: Generator::seeded(config.seed.unwrap_or(0)),
            config,
            padded: None,
        })
    }

    pub(crate) fn perform(&mut self, op: &Op) -> Result<Record, Error> {
        match op {
            Op::Reset(_) => self.reset().map(|record| Record::Reset(Box::new(record))),
            Op::Step(numbers) => self.step(actions_of(numbers)?).map(|record| Record::Step(Box::new(record))),
            Op::Astar => {
                let actions = self.plan()?;
                self.step(actions).map(|record| Record::Astar(Box::new(record)))
            }
            Op::Sample => {
                let actions = sample(&mut self.sampler, self.config.num_agents);
                self.step(actions).map(|record| Record::Sample(Box::new(record)))
            }
            Op::Back => {
                let moved = self.episode.step_back()?;
                if moved {
                    self.past.pop();
                }
                Ok(Record::Back(Back { moved, state: self.episode.snapshot() }))
            }
            Op::History => Ok(Record::History(self.history())),
        }
    }

    fn reset(&mut self) -> Result<ResetRecord, Error> {
        let (instance, warnings) = self.source.next()?;
        self.warnings.extend(warnings);
        self.episode.start(instance)?;
        self.team.reset();
        self.past = vec![self.episode.snapshot()];
        let instance = self.episode.instance()?;
        let padded = self.padded(instance)?;
        self.padded = Some(padded.clone());
        let observations = self.observed(true)?;
        let is_foretold =
            self.config.on_target == OnGoal::Restart && self.config.max_episode_steps <= MAX_FORETOLD_STEPS;
        let goal_lists = is_foretold.then(|| foretold_goals(&self.config, instance)).flatten();
        let record = ResetRecord {
            derived: Derived::of(&self.config),
            map: instance.map().rows(),
            padded,
            state: self.episode.snapshot(),
            observations: Some(observations),
            goal_lists,
            goal_lists_error: None,
        };
        Ok(record)
    }

    pub(crate) fn step(&mut self, actions: Vec<Action>) -> Result<StepRecord, Error> {
        let before = self.episode.snapshot();
        self.episode.step(&actions)?;
        let state = self.episode.snapshot();
        self.past.push(state.clone());
        let observations = Some(self.observed(false)?);
        let actions_after = self.actions_after(&before, &actions, &state);
        Ok(StepRecord {
            infos_active: state.active.clone(),
            step: TraceStep {
                actions,
                state,
                rewards: self.episode.rewards().to_vec(),
                terminated: self.episode.terminated().to_vec(),
                truncated: self.episode.truncated().to_vec(),
                observations,
                metrics: self.metrics(),
            },
            actions_after,
        })
    }

    /// Returns the caller's action list as POGEMA leaves it: under `soft`, 0 replaces each reverted move.
    ///
    /// Rule: collide/soft/rewrite
    fn actions_after(&self, before: &Snapshot, actions: &[Action], after: &Snapshot) -> Vec<i64> {
        let soft = self.config.collision_system == pogema_core::Collision::Soft;
        let left = |(agent, &action): (usize, &Action)| {
            let reverted = soft && before.active[agent] && before.cells[agent] == after.cells[agent];
            if reverted { 0 } else { action as i64 }
        };
        actions.iter().enumerate().map(left).collect()
    }

    fn metrics(&self) -> Option<Metrics> {
        let metrics = self.episode.is_over().then(|| self.episode.metrics())?;
        (metrics != Metrics::default()).then_some(metrics)
    }

    fn plan(&mut self) -> Result<Vec<Action>, Error> {
        self.team.act(PomapfObservations::of(&self.episode)?.each())
    }

    fn history(&self) -> History {
        let changes = changes(&self.past);
        let last = self.past.len().saturating_sub(1) as u64;
        let full = changes.iter().map(|agent: &Vec<Change>| states_at_every_step(agent, last)).collect();
        History { full, changes }
    }

    fn padded(&self, instance: &Instance) -> Result<Padded, Error> {
        let border = 2 * self.config.obs_radius;
        let (height, width) = (instance.map().height() + border, instance.map().width() + border);
        let mut obstacles = vec![0; height * width];
        self.episode.engine().observe_map(&mut obstacles)?;
        let line = |row: &[u8]| row.iter().map(|&value| if value == 0 { '.' } else { '#' }).collect();
        Ok(Padded {
            dtype: padded_dtype(&self.config).into(),
            rows: obstacles.chunks(width).map(line).collect(),
        })
    }

    fn observed(&self, at_reset: bool) -> Result<Observed, Error> {
        let side = self.config.obs_radius * 2 + 1;
        let packed = |window: &[f32]| pack(window, |&value| value != 0.0);
        if self.config.observation_type == Observation::Default {
            let mut values = vec![0.0; self.episode.config().num_observed()];
            self.episode.engine().observe(&mut values)?;
            let windows = values.chunks(3 * side * side).map(packed).collect();
            return Ok(Observed::Default { dtype: "float32".into(), windows, odd: Vec::new() });
        }
        let windows = PomapfObservations::of(&self.episode)?;
        let pomapf = ObservedPomapf {
            dtype: "float32".into(),
            obstacles: windows.obstacles.chunks(side * side).map(packed).collect(),
            agents: windows.agents.chunks(side * side).map(packed).collect(),
            xy: windows.cells,
            target_xy: windows.goals,
            odd: Vec::new(),
        };
        if self.config.observation_type == Observation::Pomapf {
            return Ok(Observed::Pomapf(pomapf));
        }
        let (state, radius) = (self.episode.state(), self.config.obs_radius);
        Ok(Observed::Mapf(ObservedMapf {
            pomapf,
            global_obstacles: if at_reset { self.padded.clone() } else { None },
            global_xy: from_border(state.cells, radius).collect(),
            global_target_xy: from_border(state.goals, radius).collect(),
        }))
    }
}
