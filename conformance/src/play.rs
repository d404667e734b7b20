//! Our own answers to a request.

use pogema_core::{
    Action, Change, CollisionMeter, Config, DensityMeter, Environment, EpisodeMeter, Error, Instance,
    MapfOut, Metrics, Observation, Observed, ObservedMapf, ObservedPomapf, OnGoal, Outside, Padded, Snapshot,
    StepOut, TraceStep, changes, states_at_every_step,
};
use pogema_maps::{GridConfig, InstanceSource, foretold_goals};
use pogema_numpy::Generator;
use pogema_planners::{AStarTeam, PomapfObservations, pairs, pogema_team, sample};

use crate::digits::pack;
use crate::request::{
    Back, Derived, Failure, History, Op, Record, Request, ResetRecord, Response, StepRecord, When,
};

/// Longer episodes have too many goals to list; the oracle lists none for them either.
const MOST_FORETOLD_STEPS: i64 = 4096;

/// An engine to play with.
#[derive(Clone, Copy, Debug)]
pub struct Engine {
    /// Its name in reports.
    pub name: &'static str,
    /// Makes an environment of it.
    pub make: fn(Config) -> Result<Box<dyn Environment>, Error>,
}

impl Engine {
    /// The reference.
    pub const REFERENCE: Self =
        Self { name: "reference", make: |config| Ok(Box::new(pogema_reference::Reference::new(config)?)) };
    /// POGEMA's procedures, step for step.
    pub const LITERAL: Self =
        Self { name: "literal", make: |config| Ok(Box::new(crate::Literal::new(config)?)) };
}

/// Makes an environment for a config.
pub type Make<'a> = dyn Fn(Config) -> Result<Box<dyn Environment>, Error> + 'a;

/// Plays a request on the reference.
pub fn play(request: &Request) -> Response {
    play_on(Engine::REFERENCE, request)
}

/// Plays a request on an engine.
pub fn play_on(engine: Engine, request: &Request) -> Response {
    let mut response = Response { id: Some(request.id), ..Response::default() };
    let mut player = match Player::new(&engine.make, request) {
        Ok(player) => player,
        Err(error) => {
            response.error = Some(failure(When::Phase("config".into()), &error));
            return response;
        }
    };
    for (index, op) in request.ops.iter().enumerate() {
        match player.perform(op) {
            Ok(record) => response.records.push(record),
            Err(error) => {
                response.error = Some(failure(When::Op(index), &error));
                break;
            }
        }
    }
    response.warnings = player.warnings;
    response
}

fn failure(when: When, error: &Error) -> Failure {
    Failure { when, kind: "Error".into(), message: error.to_string() }
}

/// Where the instances of the episodes come from.
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

/// One request at work.
pub(crate) struct Player {
    pub(crate) config: GridConfig,
    source: Source,
    pub(crate) environment: Box<dyn Environment>,
    pub(crate) instance: Option<Instance>,
    warnings: Vec<String>,
    meter: EpisodeMeter,
    density: Option<DensityMeter>,
    collisions: Option<CollisionMeter>,
    past: Vec<Snapshot>,
    team: AStarTeam,
    sampler: Generator,
    padded: Option<Padded>,
}

impl Player {
    pub(crate) fn new(make: &Make<'_>, request: &Request) -> Result<Self, Error> {
        let config = GridConfig::from_value(&request.config)?;
        let named = request.register.as_ref().filter(|map| config.map_name.as_ref() == Some(&map.name));
        let registered = named.map(|map| pogema_core::Map::from_rows(&map.rows)).transpose()?;
        let source = Source::Drawn(Box::new(InstanceSource::new(config.clone(), registered)?));
        let mut player = Self::with_source(make, config, source)?;
        player.density = request.density.then(DensityMeter::default);
        player.collisions = request.collisions.then(CollisionMeter::default);
        Ok(player)
    }

    /// A player of one instance, whose episodes all begin alike.
    pub(crate) fn of_instance(make: &Make<'_>, rules: &Config, instance: Instance) -> Result<Self, Error> {
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
        Self::with_source(make, config, Source::Given(Box::new(instance)))
    }

    fn with_source(make: &Make<'_>, config: GridConfig, source: Source) -> Result<Self, Error> {
        let rules = config.rules();
        Ok(Self {
            source,
            environment: make(rules)?,
            instance: None,
            warnings: Vec::new(),
            meter: EpisodeMeter::new(&rules),
            density: None,
            collisions: None,
            past: Vec::new(),
            team: pogema_team(),
            sampler: Generator::seeded(config.seed.unwrap_or(0)),
            config,
            padded: None,
        })
    }

    /// Measures what is only measured on request.
    pub(crate) fn measure(&mut self, figures: &[String]) {
        let wants = |name: &str| figures.iter().any(|figure| figure == name);
        self.density = wants("avg_agents_density").then(DensityMeter::default);
        self.collisions = (wants("a_collisions") || wants("o_collisions")).then(CollisionMeter::default);
    }

    pub(crate) fn perform(&mut self, op: &Op) -> Result<Record, Error> {
        match op {
            Op::Reset(_) => self.reset().map(|record| Record::Reset(Box::new(record))),
            Op::Step(numbers) => {
                let actions = numbers.iter().enumerate();
                let actions: Result<_, _> =
                    actions.map(|(agent, &number)| Action::from_number(agent, number)).collect();
                self.step(actions?).map(|record| Record::Step(Box::new(record)))
            }
            Op::Astar => {
                let actions = self.plan()?;
                self.step(actions).map(|record| Record::Astar(Box::new(record)))
            }
            Op::Sample => {
                let actions = sample(&mut self.sampler, self.config.num_agents);
                self.step(actions).map(|record| Record::Sample(Box::new(record)))
            }
            Op::Back => {
                let moved = self.environment.step_back()?;
                if moved {
                    self.past.pop();
                }
                Ok(Record::Back(Back { moved, state: self.state() }))
            }
            Op::History => Ok(Record::History(self.history())),
        }
    }

    fn reset(&mut self) -> Result<ResetRecord, Error> {
        let (instance, warnings) = self.source.next()?;
        self.warnings.extend(warnings);
        self.environment.reset(&instance)?;
        self.meter.reset();
        self.team.reset();
        self.past = vec![self.environment.snapshot()];
        let padded = self.padded(&instance)?;
        self.padded = Some(padded.clone());
        let observations = self.observed(true)?;
        if let Some(density) = &mut self.density {
            density.reset();
        }
        self.collisions = self.collisions.map(|_| CollisionMeter::default());
        self.feed_density()?;
        let may_foretell =
            self.config.on_target == OnGoal::Restart && self.config.max_episode_steps <= MOST_FORETOLD_STEPS;
        let goal_lists = may_foretell.then(|| foretold_goals(&self.config, &instance)).flatten();
        let record = ResetRecord {
            derived: Derived {
                width: self.config.width,
                height: self.config.height,
                size: self.config.size,
                density: self.config.density,
                num_agents: self.config.num_agents,
            },
            map: instance.map().rows(),
            padded,
            state: self.state(),
            observations: Some(observations),
            goal_lists,
            goal_lists_error: None,
        };
        self.instance = Some(instance);
        Ok(record)
    }

    pub(crate) fn step(&mut self, actions: Vec<Action>) -> Result<StepRecord, Error> {
        let num_agents = self.config.num_agents;
        let before = self.state();
        let mut rewards = vec![0.0; num_agents];
        let mut terminated = vec![false; num_agents];
        let mut truncated = vec![false; num_agents];
        let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
        self.environment.step(&actions, out)?;
        let state = self.state();
        self.past.push(self.environment.snapshot());
        self.feed_density()?;
        self.count_collisions(&before, &actions, &state);
        let metrics = self.metrics(&state, &terminated, &truncated);
        let observations = Some(self.observed(false)?);
        let actions_after = self.actions_after(&before, &actions, &state);
        Ok(StepRecord {
            infos_active: state.active.clone(),
            step: TraceStep { actions, state, rewards, terminated, truncated, observations, metrics },
            actions_after,
        })
    }

    fn state(&self) -> Snapshot {
        // The number of the step is not among what implementations answer.
        Snapshot { step: 0, ..self.environment.snapshot() }
    }

    /// What POGEMA leaves of the caller's list: under `soft` a prevented move becomes a wait.
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

    fn metrics(&mut self, state: &Snapshot, terminated: &[bool], truncated: &[bool]) -> Option<Metrics> {
        // POGEMA's persistent environments measure nothing but the density, which a wrapper outside adds.
        let figures = self.meter.feed(&state.on_goal, terminated, truncated)?;
        let figures = if self.config.persistent { Metrics::default() } else { figures };
        let avg_agents_density = self.density.as_ref().map(DensityMeter::mean);
        let collisions = self.collisions.map(|meter| (meter.with_agents as f64, meter.with_obstacles as f64));
        let (a_collisions, o_collisions) = collisions.unzip();
        let metrics = Metrics { avg_agents_density, a_collisions, o_collisions, ..figures };
        (metrics != Metrics::default()).then_some(metrics)
    }

    fn count_collisions(&mut self, before: &Snapshot, actions: &[Action], after: &Snapshot) {
        if let (Some(meter), Some(instance)) = (&mut self.collisions, &self.instance) {
            meter.feed(instance.map(), &before.cells, &before.active, actions, &after.cells);
        }
    }

    fn feed_density(&mut self) -> Result<(), Error> {
        if self.density.is_none() {
            return Ok(());
        }
        let windows = PomapfObservations::of(&*self.environment)?;
        let counts = windows.counts();
        if let Some(density) = &mut self.density {
            density.feed(counts.into_iter());
        }
        Ok(())
    }

    fn plan(&mut self) -> Result<Vec<Action>, Error> {
        let windows = PomapfObservations::of(&*self.environment)?;
        self.team.act(windows.each())
    }

    fn history(&self) -> History {
        let changes = changes(&self.past);
        let last = self.past.last().map_or(0, |state| state.step);
        let full = changes.iter().map(|agent: &Vec<Change>| states_at_every_step(agent, last)).collect();
        History { full, changes }
    }

    fn padded(&self, instance: &Instance) -> Result<Padded, Error> {
        let border = 2 * self.config.obs_radius;
        let (height, width) = (instance.map().height() + border, instance.map().width() + border);
        let (mut obstacles, mut places) = (vec![0; height * width], vec![0; 4 * self.config.num_agents]);
        let (cells, goals) = places.split_at_mut(2 * self.config.num_agents);
        self.environment.observe_mapf(MapfOut { obstacles: &mut obstacles, cells, goals })?;
        let line = |row: &[u8]| row.iter().map(|&value| if value == 0 { '.' } else { '#' }).collect();
        let dtype = if self.config.empty_outside { "float64" } else { "int64" };
        Ok(Padded { dtype: dtype.into(), rows: obstacles.chunks(width).map(line).collect() })
    }

    fn observed(&self, at_reset: bool) -> Result<Observed, Error> {
        let side = self.config.obs_radius * 2 + 1;
        if self.config.observation_type == Observation::Default {
            let mut values = vec![0.0; self.environment.config().num_observed()];
            self.environment.observe(&mut values)?;
            let windows = values.chunks(3 * side * side).map(pack).collect();
            return Ok(Observed::Default { dtype: "float32".into(), windows, odd: Vec::new() });
        }
        let windows = PomapfObservations::of(&*self.environment)?;
        let pomapf = ObservedPomapf {
            dtype: "float32".into(),
            obstacles: windows.obstacles.chunks(side * side).map(pack).collect(),
            agents: windows.agents.chunks(side * side).map(pack).collect(),
            xy: pairs(&windows.cells),
            target_xy: pairs(&windows.goals),
            odd: Vec::new(),
        };
        if self.config.observation_type == Observation::Pomapf {
            return Ok(Observed::Pomapf(pomapf));
        }
        let num_agents = self.config.num_agents;
        let num_cells = self.padded.as_ref().map_or(0, |padded| padded.rows.iter().map(String::len).sum());
        let (mut obstacles, mut cells, mut goals) =
            (vec![0; num_cells], vec![0; 2 * num_agents], vec![0; 2 * num_agents]);
        let out = MapfOut { obstacles: &mut obstacles, cells: &mut cells, goals: &mut goals };
        self.environment.observe_mapf(out)?;
        let global_obstacles = if at_reset { self.padded.clone() } else { None };
        let (global_xy, global_target_xy) = (pairs(&cells), pairs(&goals));
        Ok(Observed::Mapf(ObservedMapf { pomapf, global_obstacles, global_xy, global_target_xy }))
    }
}
