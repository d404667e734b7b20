//! Rewards for steps towards the goal.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use pogema_core::{Cell, Environment, Error, State};
use pogema_fast::{Batch, Engine};
use pogema_planners::{CostToGo, Distances, Graph, UNREACHABLE};

use super::encoders::{CACHE_BYTES, surroundings_of};

/// Rewards each agent of a batch for steps towards its goal, and penalizes steps away from it.
///
/// The distance is the number of steps to the goal without other agents. A step nearer adds
/// 1 / (height + width) to the reward; a step away subtracts the same amount. If there is no path to the goal, the
/// reward stays unchanged.
pub struct DenseRewards {
    lanes: Vec<Lane>,
}

/// The agents of one environment before a step.
#[derive(Default)]
struct Lane {
    /// The episode that the other fields describe, counted from 1; 0 before the first.
    begun: u64,
    distances: Option<Distances>,
    agents: Vec<Agent>,
    /// The reward of one step nearer.
    share: f32,
}

struct Agent {
    cell: Cell,
    goal: Cell,
    /// Absent if the goal is an obstacle.
    costs: Option<CostToGo>,
}

impl DenseRewards {
    pub fn new(num_envs: usize) -> Self {
        Self { lanes: (0..num_envs).map(|_| Lane::default()).collect() }
    }

    /// Returns the approximate work of [`DenseRewards::prepare`], in visited cells.
    pub fn work(&self, batch: &Batch) -> usize {
        let of = |(env, lane): (usize, &Lane)| Ok(lane.work(batch.lane(env)?, batch.num_begun(env)?));
        // Without a reset there is no work, and the step is an error.
        self.lanes.iter().enumerate().map(of).sum::<Result<_, Error>>().unwrap_or(0)
    }

    /// Computes the distances to all current goals before a step.
    ///
    /// # Errors
    /// [`Error::Cancelled`] if another thread sets `stop`.
    pub fn prepare(&mut self, batch: &mut Batch, stop: &AtomicBool) -> Result<(), Error> {
        let cache_bytes = CACHE_BYTES / self.lanes.len();
        let parts = self.lanes.iter_mut().enumerate().collect();
        let done = batch.share(parts, |batch, (env, lane): (usize, &mut Lane)| {
            lane.prepare(batch.lane(env)?, batch.num_begun(env)?, cache_bytes, stop)
        });
        done.into_iter().collect()
    }

    /// Adds the rewards of the step after [`DenseRewards::prepare`].
    ///
    /// Shape: `rewards` is `(envs, agents)`
    pub fn add(&self, batch: &mut Batch, rewards: &mut [f32]) -> Result<(), Error> {
        let rows = rewards.chunks_exact_mut(batch.config().num_agents);
        let parts = self.lanes.iter().zip(rows).enumerate().collect();
        let done = batch.share(parts, |batch, (env, (lane, rewards)): (usize, (&Lane, &mut [f32]))| {
            if batch.num_begun(env)? == lane.begun {
                lane.add(batch.lane(env)?.state(), rewards);
            } else if let (true, Some((ended, _))) = (batch.has_just_ended(env)?, batch.ended(env)?) {
                // With autoreset in the same step, the next episode has begun.
                lane.add(ended.state(), rewards);
            }
            Ok(())
        });
        done.into_iter().collect()
    }
}

impl Lane {
    fn work(&self, engine: &Engine, begun: u64) -> usize {
        let (rows, columns) = engine.size();
        let goals = engine.state().goals;
        let is_known =
            |(agent, goal): &(usize, &Cell)| self.agents.get(*agent).is_some_and(|of| of.goal == **goal);
        let num_known =
            if self.begun == begun { goals.iter().enumerate().filter(is_known).count() } else { 0 };
        rows * columns * (goals.len() - num_known)
    }

    fn prepare(
        &mut self,
        engine: &Engine,
        begun: u64,
        cache_bytes: usize,
        stop: &AtomicBool,
    ) -> Result<(), Error> {
        if self.begun != begun || self.distances.is_none() {
            let (rows, columns) = engine.size();
            let graph = Arc::new(Graph::new(&surroundings_of(engine)?.0));
            self.distances = Some(Distances::new(graph, cache_bytes));
            self.agents.clear();
            self.share = 1.0 / (rows + columns) as f32;
            self.begun = begun;
        }
        let Some(distances) = &mut self.distances else { return Ok(()) };
        let state = engine.state();
        for (agent, (&cell, &goal)) in state.cells.iter().zip(state.goals).enumerate() {
            match self.agents.get_mut(agent) {
                Some(known) if known.goal == goal => known.cell = cell,
                _ if stop.load(Relaxed) => return Err(Error::Cancelled),
                known => {
                    let vertex = distances.graph().vertex(goal);
                    let next = Agent { cell, goal, costs: vertex.map(|vertex| distances.to(vertex)) };
                    match known {
                        Some(known) => *known = next,
                        None => self.agents.push(next),
                    }
                }
            }
        }
        Ok(())
    }

    fn add(&self, after: State<'_>, rewards: &mut [f32]) {
        let Some(graph) = self.distances.as_ref().map(Distances::graph) else { return };
        for ((agent, &cell), reward) in self.agents.iter().zip(after.cells).zip(rewards) {
            let Some(costs) = agent.costs.as_ref().filter(|_| agent.cell != cell) else { continue };
            let cost = |cell| graph.vertex(cell).map_or(UNREACHABLE, |vertex| costs[vertex as usize]);
            match (cost(agent.cell), cost(cell)) {
                (UNREACHABLE, _) | (_, UNREACHABLE) => {}
                (before, after) if after < before => *reward += self.share,
                _ => *reward -= self.share,
            }
        }
    }
}
