//! MATS-LP as a policy for all agents of an environment.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pogema_core::{Action, Error, Instance, OnGoal, State, check_threads};
use pogema_planners::GoalForecast;

use crate::mats_lp::cache::{Cache, Key};
use crate::mats_lp::evaluator::{Evaluator, MatsLpStats};
use crate::mats_lp::group::Groups;
use crate::mats_lp::params::MatsLpParams;
use crate::mats_lp::prior::Prior;
use crate::mats_lp::simulation::Goals;
use crate::mats_lp::tree::RootChild;
use crate::mats_lp::workers::{Found, Task, search_all};
use crate::mats_lp::world::World;

/// MATS-LP, which chooses the actions of all agents of an environment.
///
/// It knows the map, the cells of all agents and their future goals. It expects the collision system `soft`, whose
/// moves its searches simulate. Inactive agents stay and belong to no group.
///
/// Source: Skrynnik, Andreychuk, Yakovlev, Panov: Decentralized Monte Carlo Tree Search for Partially Observable
/// Multi-Agent Pathfinding, AAAI 2024
pub struct MatsLp {
    params: MatsLpParams,
    radius: usize,
    /// One for each thread.
    evaluators: Vec<Evaluator>,
    cancelled: Option<Arc<AtomicBool>>,
    episode: Option<Episode>,
    /// The children of each agent's root in the last step.
    roots: Vec<Vec<RootChild>>,
}

/// The memory of an episode.
struct Episode {
    world: World,
    cache: Cache,
    on_goal: OnGoal,
    forecast: Option<GoalForecast>,
    /// For each agent, the smallest cost to go to its current goal so far.
    best: Vec<i32>,
    next_step: u64,
}

impl MatsLp {
    /// Creates a policy that searches on `threads` threads. Their number does not change the actions.
    ///
    /// # Errors
    /// [`Error::Argument`] for a parameter or a number of threads out of range, for a network whose radius is not
    /// from 1 to 7, or for a network without a critic if the parameters are not `faithful`.
    pub fn new(prior: &dyn Prior, params: MatsLpParams, threads: usize) -> Result<Self, Error> {
        params.check()?;
        check_threads("threads", threads)?;
        let radius = prior.radius();
        if !(1..=Key::LARGEST_RADIUS).contains(&radius) {
            let expected = format!("1 to {}", Key::LARGEST_RADIUS);
            return Err(Error::argument("radius of the network", radius, expected));
        }
        if !params.faithful && !prior.has_critic() {
            return Err(Error::argument("faithful", false, "true, because the network has no critic"));
        }
        let evaluators = (0..threads).map(|_| Evaluator::new(prior)).collect();
        Ok(Self { params, radius, evaluators, cancelled: None, episode: None, roots: Vec::new() })
    }

    /// Lets any thread stop [`MatsLp::act`] by setting a flag.
    #[must_use]
    pub fn with_cancellation(self, cancelled: Option<Arc<AtomicBool>>) -> Self {
        Self { cancelled, ..self }
    }

    /// Returns the statistics of the work since the policy was created.
    pub fn stats(&self) -> MatsLpStats {
        let mut stats = MatsLpStats::default();
        for evaluator in &self.evaluators {
            stats.add_thread(evaluator.stats());
        }
        stats
    }

    /// Begins an episode. Reads its map and, if `on_goal` is [`OnGoal::Restart`], the future goals of all agents.
    pub fn begin(&mut self, instance: &Instance, on_goal: OnGoal) {
        // A simulation reaches at most one goal per step, and no leaf is deeper than the number of expansions.
        let num_goals = self.params.expansions as usize + 1;
        let forecast = (on_goal == OnGoal::Restart).then(|| GoalForecast::new(instance, num_goals));
        self.episode = Some(Episode {
            world: World::new(instance.map(), self.radius),
            cache: Cache::new(),
            on_goal,
            forecast,
            best: Vec::new(),
            next_step: 0,
        });
    }

    /// Returns the actions of all agents; inactive agents stay. Call it in every step of the episode.
    ///
    /// # Errors
    /// [`Error::NotReset`] before [`MatsLp::begin`]; [`Error::OutOfStep`] for a state that is not the next one of the
    /// episode; [`Error::Length`] for a list of the wrong length; [`Error::Agent`] for a cell or goal outside the map;
    /// [`Error::Cancelled`] if the work is cancelled; [`Error::Corrupt`] if the network's outputs are not finite; the
    /// errors of the network. After an error, begin a new episode.
    pub fn act(&mut self, now: State<'_>) -> Result<Vec<Action>, Error> {
        let episode = self.episode.as_mut().ok_or(Error::NotReset)?;
        episode.follow(now)?;
        let Episode { world, cache, on_goal, forecast, best, .. } = episode;
        let mut groups = Groups::new(world, now.cells, now.active);
        let active = (0..now.cells.len()).filter(|&agent| now.active[agent]);
        let groups: Vec<Vec<usize>> = active.map(|agent| groups.of(agent, &self.params)).collect();
        let repeats_last = *on_goal != OnGoal::Finish;
        let list = |agent| forecast.as_ref().map_or(&now.goals[agent..=agent], |all| all.goals(agent));
        let goals: Vec<Goals<'_>> =
            (0..now.cells.len()).map(|agent| Goals { list: list(agent), repeats_last }).collect();
        let task = Task {
            params: self.params,
            radius: self.radius,
            world,
            cache,
            cells: now.cells,
            goals: &goals,
            best,
            step: now.step,
            cancelled: self.cancelled.as_deref(),
        };
        let mut actions = vec![Action::Stay; now.cells.len()];
        self.roots.clear();
        self.roots.resize(now.cells.len(), Vec::new());
        for Found { agent, action, root } in search_all(&task, groups, &mut self.evaluators)? {
            actions[agent] = action;
            self.roots[agent] = root;
        }
        Ok(actions)
    }

    /// Returns the children of the root of an agent's search in the last step; none if it did not search in that step.
    ///
    /// Children are joint actions of the group in ascending order; the agent's own action varies fastest.
    pub fn root(&self, agent: usize) -> &[RootChild] {
        self.roots.get(agent).map_or(&[], Vec::as_slice)
    }
}

impl Episode {
    /// Advances to the next state.
    fn follow(&mut self, now: State<'_>) -> Result<(), Error> {
        let num_agents = if self.next_step == 0 { now.cells.len() } else { self.best.len() };
        now.check_next(self.next_step, num_agents)?;
        Error::check_length("goals", now.cells.len(), now.goals.len())?;
        Error::check_length("active", now.cells.len(), now.active.len())?;
        self.world.check_inside("cell", now.cells)?;
        self.world.check_inside("goal", now.goals)?;
        if let Some(forecast) = &mut self.forecast {
            forecast.follow(now)?;
        }
        self.world.follow(now, &mut self.best);
        self.next_step += 1;
        Ok(())
    }
}
