//! The work to measure: single environments and batches.

use std::sync::Arc;
use std::time::Duration;

use pogema_core::{Action, Environment, Error, StepOut, counted};
use pogema_fast::{Batch, Engine, Observations, words_per_agent};
use pogema_maps::{GridConfig, InstanceSource};
use pogema_numpy::Generator;
use pogema_planners::sample;
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::Serialize;
use serde_json::{Value, json};

use super::timing::{calls_per_second, fills_per_second};

/// The minimum number of steps and of single actions that are sampled beforehand. Processors learn to predict the
/// branches of a short sequence that repeats, so its steps would be faster than those of an agent that learns or plans.
const MIN_STEPS: usize = 16;
const MIN_ACTIONS: usize = 1 << 20;

/// The work of one row of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Work {
    /// Number of environments in the batch; `None` for a single environment.
    pub lanes: Option<usize>,
    pub threads: usize,
    pub num_agents: usize,
    pub size: usize,
    /// Whether agents get a new goal after each one they reach.
    pub lifelong: bool,
}

/// Measured speeds, each per second, and the memory of the engine.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Speed {
    /// Agent steps.
    pub step: f64,
    /// Observations without steps.
    pub f32: f64,
    pub u8: f64,
    pub bits: f64,
    /// Agent steps with observations.
    pub step_f32: f64,
    pub step_u8: f64,
    /// Observation buffers filled with zeros.
    pub fill_f32: f64,
    pub fill_u8: f64,
    /// Seeded resets: generation and placement of an instance, and the reset of the engine.
    pub reset: f64,
    /// Memory of the engine, without observation buffers. Units: bytes.
    pub bytes: usize,
}

impl Speed {
    /// Takes the better figures from another measurement of the same work.
    pub fn improve(&mut self, other: &Self) {
        let Self { step, f32, u8, bits, step_f32, step_u8, fill_f32, fill_u8, reset, bytes: _ } = self;
        for (own, other) in [
            (step, other.step),
            (f32, other.f32),
            (u8, other.u8),
            (bits, other.bits),
            (step_f32, other.step_f32),
            (step_u8, other.step_u8),
            (fill_f32, other.fill_f32),
            (fill_u8, other.fill_u8),
            (reset, other.reset),
        ] {
            *own = own.max(other);
        }
    }
}

impl Work {
    /// Returns the config of the paper, with POGEMA's field names.
    pub fn config(&self) -> Value {
        json!({
            "num_agents": self.num_agents, "size": self.size, "density": 0.3, "obs_radius": 5, "seed": 0,
            "collision_system": "soft", "on_target": if self.lifelong { "restart" } else { "nothing" },
            "max_episode_steps": if self.lanes.is_some() { 256 } else { 1_000_000_000 },
        })
    }

    pub fn name(&self) -> String {
        let agents = counted(self.num_agents, "agent");
        let mode = if self.lifelong { "LMAPF" } else { "MAPF" };
        let size = self.size;
        let name = match self.lanes {
            None => format!("{agents}, {size} x {size}, {mode}"),
            Some(1) => format!("1 lane of {agents}, {size} x {size}, {mode}"),
            Some(lanes) => format!("{lanes} lanes of {agents}, {size} x {size}, {mode}"),
        };
        if self.threads == 1 { name } else { format!("{name}, {} threads", self.threads) }
    }

    pub fn measure(&self, budget: Duration) -> Result<Speed, Error> {
        match self.lanes {
            None => self.measure_engine(budget),
            Some(lanes) => self.measure_batch(budget, lanes),
        }
    }

    fn measure_engine(&self, budget: Duration) -> Result<Speed, Error> {
        let config = GridConfig::from_value(&self.config())?;
        let mut source = InstanceSource::new(config.clone(), None)?;
        let mut engine = Engine::new(config.rules())?;
        let pool = self.pool()?;
        if let Some(pool) = &pool {
            engine = engine.with_pool(Arc::clone(pool));
        }
        let mut failure = Ok(());
        let reset = calls_per_second(budget, || {
            if let Err(error) = source.generate().and_then(|generated| engine.start(generated.instance)) {
                failure = Err(error);
            }
        });
        failure?;
        let (bytes, mut actions) = (engine.num_bytes(), Actions::sample(self.num_agents));
        let mut ends = Ends::new(self.num_agents);
        let act = |is_step: bool, observations: Observations<'_>| {
            if is_step {
                engine.step(actions.next(), ends.out())?;
            }
            match observations {
                // `Speed::step` times steps alone.
                Observations::None => Ok(()),
                observations => engine.observe_into(observations),
            }
        };
        Ok(Speed { reset, bytes, ..self.rates(budget, 1, pool.as_deref(), act)? })
    }

    fn measure_batch(&self, budget: Duration, lanes: usize) -> Result<Speed, Error> {
        let config = self.config();
        let rules = GridConfig::from_value(&config)?.rules();
        let source = move |lane: usize, episode: u64| {
            let mut config = config.clone();
            config["seed"] = (episode * lanes as u64 + lane as u64).into();
            let mut source = InstanceSource::new(GridConfig::from_value(&config)?, None)?;
            Ok(source.generate()?.instance)
        };
        let pool = self.pool()?;
        let mut batch = Batch::new(rules, lanes, self.threads, source)?;
        let mut failure = Ok(());
        let reset = calls_per_second(budget, || {
            if let Err(error) = batch.reset() {
                failure = Err(error);
            }
        });
        let reset = lanes as f64 * reset;
        failure?;
        let bytes = (0..lanes).map(|lane| batch.lane(lane).map(Engine::num_bytes)).sum::<Result<_, _>>()?;
        let mut actions = Actions::sample(lanes * self.num_agents);
        let mut ends = Ends::new(lanes * self.num_agents);
        let act = |is_step: bool, observations: Observations<'_>| {
            if !is_step {
                return batch.observe(observations);
            }
            batch.step(actions.next(), ends.out(), observations)
        };
        Ok(Speed { reset, bytes, ..self.rates(budget, lanes, pool.as_deref(), act)? })
    }

    /// Times steps and observations; `act` makes them, and its flag says whether it steps before it observes.
    fn rates(
        &self,
        budget: Duration,
        lanes: usize,
        pool: Option<&ThreadPool>,
        mut act: impl FnMut(bool, Observations<'_>) -> Result<(), Error>,
    ) -> Result<Speed, Error> {
        let num_agents = lanes * self.num_agents;
        let (mut floats, mut bytes, mut words) = self.buffers(lanes)?;
        let mut rate = Rate { budget, num_agents, failure: Ok(()) };
        let speed = Speed {
            step: rate.of(|| act(true, Observations::None)),
            fill_f32: num_agents as f64 * fills_per_second(budget, pool, &mut floats),
            f32: rate.of(|| act(false, Observations::F32(&mut floats))),
            step_f32: rate.of(|| act(true, Observations::F32(&mut floats))),
            fill_u8: num_agents as f64 * fills_per_second(budget, pool, &mut bytes),
            u8: rate.of(|| act(false, Observations::U8(&mut bytes))),
            step_u8: rate.of(|| act(true, Observations::U8(&mut bytes))),
            bits: rate.of(|| act(false, Observations::Bits(&mut words))),
            ..Speed::default()
        };
        rate.failure.map(|()| speed)
    }

    fn pool(&self) -> Result<Option<Arc<ThreadPool>>, Error> {
        let pool = (self.threads > 1).then(|| ThreadPoolBuilder::new().num_threads(self.threads).build());
        let pool = pool.transpose().map_err(|error| Error::external("threads", error))?;
        Ok(pool.map(Arc::new))
    }

    fn buffers(&self, lanes: usize) -> Result<Buffers, Error> {
        let config = GridConfig::from_value(&self.config())?.rules();
        let num_values = lanes * config.num_observed();
        let num_words = lanes * self.num_agents * words_per_agent(config.radius);
        Ok((vec![0.0; num_values], vec![0; num_values], vec![0; num_words]))
    }
}

/// Buffers for observations as `f32`, `u8` and bits.
type Buffers = (Vec<f32>, Vec<u8>, Vec<u64>);

/// Times work that is done for all agents.
struct Rate {
    budget: Duration,
    num_agents: usize,
    failure: Result<(), Error>,
}

impl Rate {
    fn of(&mut self, mut work: impl FnMut() -> Result<(), Error>) -> f64 {
        let calls = calls_per_second(self.budget, || {
            if let Err(error) = work() {
                self.failure = Err(error);
            }
        });
        calls * self.num_agents as f64
    }
}

/// Random actions of many steps, which repeat after the last one.
struct Actions {
    sequence: Vec<Action>,
    num_agents: usize,
    /// Index of the first action of the next step.
    start: usize,
}

impl Actions {
    fn sample(num_agents: usize) -> Self {
        let num_steps = MIN_STEPS.max(MIN_ACTIONS / num_agents);
        let sequence = sample(&mut Generator::seeded(0), num_steps * num_agents);
        Self { sequence, num_agents, start: 0 }
    }

    /// Returns the actions of the next step.
    fn next(&mut self) -> &[Action] {
        let end = self.start + self.num_agents;
        let step = &self.sequence[self.start..end];
        self.start = if end < self.sequence.len() { end } else { 0 };
        step
    }
}

/// Buffers for the results of a step.
struct Ends {
    rewards: Vec<f32>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
}

impl Ends {
    fn new(num_agents: usize) -> Self {
        let (terminated, truncated) = (vec![false; num_agents], vec![false; num_agents]);
        Self { rewards: vec![0.0; num_agents], terminated, truncated }
    }

    fn out(&mut self) -> StepOut<'_> {
        let Self { rewards, terminated, truncated } = self;
        StepOut { rewards, terminated, truncated }
    }
}
