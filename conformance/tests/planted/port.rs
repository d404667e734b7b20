//! A port with a planted bug.

use std::sync::{Arc, Mutex};

use pogema_conformance::port::{Ask, Beginning, Hello, Key, Link, Misbehaviour, Reply, Server};
use pogema_core::{Cell, GoalSource, GoalStream, Instance, Map, OnGoal};
use pogema_maps::{Components, GridConfig, InstanceSource};
use pogema_numpy::Generator;
use serde_json::{Value, json};

use crate::bug::Bug;
use crate::engine::BuggyEngine;

pub struct Planted {
    bug: Bug,
    server: Server,
    num_agents: usize,
    radius: i64,
    starts: Vec<[i64; 2]>,
    elapsed: u64,
}

impl Planted {
    pub fn new(bug: Bug) -> Self {
        let server = Server::with(&format!("{bug:?}"), move |config| BuggyEngine::make(bug, config));
        Self { bug, server, num_agents: 0, radius: 0, starts: Vec::new(), elapsed: 0 }
    }

    /// Generates the instance here if the bug is in the generation.
    fn begin(&mut self, beginning: &Beginning) -> Option<Reply> {
        let config = GridConfig::from_value(beginning.config.as_ref()?).ok()?;
        let drawn = InstanceSource::new(config.clone(), None).ok()?.generate().ok()?.instance;
        let instance = draw(self.bug, &config, &drawn)?;
        let mut reply = self.server.begin_with(&config.rules(), instance.clone()).ok()?;
        reply.map = Some(instance.map().rows());
        reply.foretold = Key::LeftOut;
        reply.derived = None;
        Some(reply)
    }

    /// Records the origins of positions.
    fn record_origins(&mut self, beginning: &Beginning, reply: &Reply) {
        let config = beginning.config.as_ref().and_then(|config| GridConfig::from_value(config).ok());
        let header_radius = beginning.instance.as_ref().map(|header| header.config.radius);
        if let Some(radius) = header_radius.or(config.map(|config| config.obs_radius)) {
            self.radius = radius as i64;
        }
        self.starts = reply.cells.clone().unwrap_or_default();
    }

    fn corrupt_positions(&self, observations: &mut Value) {
        let mut add = |name: &str, origin: &dyn Fn(usize) -> [i64; 2]| {
            let Some(pairs) = observations.get_mut(name).and_then(Value::as_array_mut) else { return };
            for (agent, pair) in pairs.iter_mut().enumerate() {
                let [down, right] = origin(agent);
                *pair = json!([pair[0].as_i64().unwrap() + down, pair[1].as_i64().unwrap() + right]);
            }
        };
        match self.bug {
            Bug::PositionsFromCorner => {
                ["xy", "target_xy"].map(|name| add(name, &|agent| self.starts[agent]))
            }
            Bug::GlobalPositionsWithoutBorder => {
                ["global_xy", "global_target_xy"].map(|name| add(name, &|_| [-self.radius; 2]))
            }
            _ => return,
        };
    }

    fn corrupt_metrics(&self, reply: &mut Reply) {
        let Key::Given(metrics) = &mut reply.metrics else { return };
        match self.bug {
            Bug::MakespanOneShort => metrics.makespan = metrics.makespan.map(|steps| steps - 1.0),
            Bug::SumOfCostsCountsFromZero => {
                metrics.soc = metrics.soc.map(|steps| steps - self.num_agents as f64);
            }
            Bug::LengthIsOfEpisode => metrics.ep_length = metrics.ep_length.map(|_| self.elapsed as f64),
            Bug::SolvedIfAnyIs => {
                metrics.csr = metrics.isr.map(|share| f64::from(u8::from(share > 0.0)));
            }
            Bug::ThroughputOfEachAgent => {
                metrics.avg_throughput = metrics.avg_throughput.map(|all| all / self.num_agents as f64);
            }
            _ => {}
        }
    }
}

impl Link for Planted {
    fn hello(&mut self) -> Result<Hello, Misbehaviour> {
        let mut hello = self.server.hello()?;
        let draws = Bug::ShuffleForwards as usize..=Bug::NextGoalMayBeHere as usize;
        if draws.contains(&(self.bug as usize)) {
            hello.tells.clear();
        }
        Ok(hello)
    }

    fn ask(&mut self, ask: &Ask) -> Result<Reply, Misbehaviour> {
        if let Ask::Reset(beginning) = ask {
            self.elapsed = 0;
            if let Some(reply) = self.begin(beginning) {
                return Ok(reply);
            }
        }
        let mut reply = self.server.ask(ask)?;
        self.num_agents = reply.cells.as_ref().map_or(self.num_agents, Vec::len);
        self.elapsed += u64::from(reply.rewards.is_some());
        if let Ask::Reset(beginning) = ask {
            self.record_origins(beginning, &reply);
        }
        if let Some(observations) = &mut reply.observations {
            self.corrupt_positions(observations);
        }
        self.corrupt_metrics(&mut reply);
        if let (Bug::CallersListUntouched, Ask::Step { actions }) = (self.bug, ask) {
            reply.actions_after = reply.actions_after.map(|_| actions.clone());
        }
        Ok(reply)
    }
}

/// Generates the instance as a port with this bug does; returns `None` if the bug makes no difference.
fn draw(bug: Bug, config: &GridConfig, drawn: &Instance) -> Option<Instance> {
    let restarts = config.on_target == OnGoal::Restart;
    let is_seeded = config.map.is_none() && config.map_name.is_none() && config.agents_xy.is_none();
    let has_pools = config.possible_agents_xy.is_some() || config.possible_targets_xy.is_some();
    if has_pools || config.targets_xy.is_some() {
        return None;
    }
    match bug {
        Bug::ObstaclesColumnByColumn if is_seeded && !restarts => {
            let map = columns_first(config)?;
            let (starts, goals) = pairs(Bug::None, config, &map)?;
            Instance::new(map, drawn.outside().clone(), starts, goals).ok()
        }
        Bug::ShuffleForwards | Bug::DrawsOf64Bits | Bug::PairsAcrossComponents if !restarts => {
            let (starts, goals) = pairs(bug, config, drawn.map())?;
            Instance::new(drawn.map().clone(), drawn.outside().clone(), starts, goals).ok()
        }
        Bug::OneStreamForAllGoals | Bug::NextGoalMayBeHere if restarts => {
            let streams = streams(bug, config, drawn)?;
            let starts = drawn.starts().to_vec();
            Instance::new(drawn.map().clone(), drawn.outside().clone(), starts, streams).ok()
        }
        _ => None,
    }
}

fn columns_first(config: &GridConfig) -> Option<Map> {
    let (height, width) = (config.height, config.width);
    let mut drawn = Vec::new();
    let mut generator = Generator::seeded(config.seed?);
    generator.binomial1_array(config.density, height * width, |obstacle| drawn.push(obstacle)).ok()?;
    let obstacles = (0..height * width).map(|at| drawn[at % width * height + at / width]).collect();
    Map::new(height, width, obstacles).ok()
}

/// Draws an integer from 0 to `max` by rejection of larger numbers.
fn interval(bug: Bug, generator: &mut Generator, max: usize) -> usize {
    let mask = (max + 1).next_power_of_two() - 1;
    loop {
        let drawn = if bug == Bug::DrawsOf64Bits {
            generator.next_u64() as usize & mask
        } else {
            generator.next_u32() as usize & mask
        };
        if drawn <= max {
            return drawn;
        }
    }
}

fn pairs(bug: Bug, config: &GridConfig, map: &Map) -> Option<(Vec<Cell>, Vec<GoalStream>)> {
    let mut generator = Generator::seeded(config.seed?);
    let mut order: Vec<usize> = (0..map.obstacles().len()).filter(|&at| !map.obstacles()[at]).collect();
    if bug == Bug::ShuffleForwards {
        for at in 0..order.len().saturating_sub(1) {
            let max = order.len() - 1 - at;
            order.swap(at, at + interval(bug, &mut generator, max));
        }
    } else {
        for at in (1..order.len()).rev() {
            order.swap(at, interval(bug, &mut generator, at));
        }
    }
    let components = Components::of(map);
    let label = |at: usize| match bug {
        Bug::PairsAcrossComponents => 0,
        _ => components.label_at(at).unwrap_or(0) as usize,
    };
    let mut left = vec![0; components.len().max(1)];
    for &at in &order {
        left[label(at)] += 1;
    }
    let mut waiting: Vec<Option<usize>> = vec![None; left.len()];
    let (mut starts, mut goals) = (Vec::new(), vec![None; config.num_agents]);
    for at in order {
        let here = label(at);
        if let Some(agent) = waiting[here].take() {
            goals[agent] = Some(GoalStream::single(map.cell_at(at)));
        } else if starts.len() < config.num_agents && left[here] >= 2 {
            left[here] -= 2;
            waiting[here] = Some(starts.len());
            starts.push(map.cell_at(at));
        }
    }
    Some((starts, goals.into_iter().collect::<Option<_>>()?))
}

fn streams(bug: Bug, config: &GridConfig, drawn: &Instance) -> Option<Vec<GoalStream>> {
    let seeds = Generator::seeded(config.seed?).integers_array(0, i64::from(i32::MAX), drawn.starts().len());
    let common = Arc::new(Mutex::new(Generator::seeded(config.seed?)));
    let components = Components::of(drawn.map());
    let cells = components.cells();
    let streams = drawn.first_goals().into_iter().zip(seeds.ok()?).map(|(goal, seed)| {
        let generator = match bug {
            Bug::OneStreamForAllGoals => Arc::clone(&common),
            _ => Arc::new(Mutex::new(Generator::seeded(seed as u64))),
        };
        let pool = cells.of(components.label(goal)?).to_vec();
        Some(GoalStream::drawn(goal, Box::new(BuggyGoals { bug, generator, pool })))
    });
    streams.collect()
}

/// Draws next goals with a bug.
#[derive(Clone, Debug)]
struct BuggyGoals {
    bug: Bug,
    generator: Arc<Mutex<Generator>>,
    pool: Vec<Cell>,
}

impl GoalSource for BuggyGoals {
    fn next_goal(&mut self, at: Cell) -> Cell {
        let mut generator = self.generator.lock().unwrap();
        loop {
            let goal = self.pool[generator.choice_index(self.pool.len()).unwrap()];
            if goal != at || self.bug == Bug::NextGoalMayBeHere {
                return goal;
            }
        }
    }

    fn boxed_clone(&self) -> Box<dyn GoalSource> {
        Box::new(self.clone())
    }
}
