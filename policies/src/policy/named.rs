//! Policies by name.

use std::time::Duration;

use pogema_core::{Action, Environment, Episode, Error, Instance, OnGoal, Words, words};
use pogema_numpy::Generator;
use pogema_planners::{
    AStarTeam, Budget, LifelongName, LifelongPolicy, Outcome, PlannerName, PlannerPolicy, PlannerSettings,
    PomapfObservations, pogema_team, sample,
};

use crate::policy::learned::LearnedPolicy;
use crate::policy::method::{Learned, LearnedName};
use crate::replan::ReplanPolicy;

words! {
    /// The policies that use neither a planner nor a network.
    pub enum SimplePolicy {
        /// Random actions, as POGEMA's `sample_actions` draws them.
        Random = "random",
        /// POGEMA's own A* policy, one instance for each agent.
        Astar = "astar",
        /// RePlan: for each agent, a search through cells in which it has seen no obstacle.
        Replan = "replan",
        /// All agents stay.
        Stay = "stay",
    }
}

/// The settings of a policy.
#[derive(Clone, Debug, Default)]
pub struct PolicySettings {
    /// The budget of one plan.
    pub budget: Budget,
    /// Settings of the planner. A network draws its actions from the same seed.
    pub planner: PlannerSettings,
    /// Whether a lifelong planner knows future goals.
    pub future_goals: bool,
    /// Whether a one-shot planner that finds no plan is not called again in that episode.
    pub single_attempt: bool,
    /// The network of a learned policy, as [`LearnedName::read`] returns it.
    pub learned: Option<Learned>,
}

/// A policy for all agents of one episode, made by name.
pub struct NamedPolicy(Kind);

enum Kind {
    Random(Box<Generator>),
    Astar(AStarTeam),
    Replan(Box<ReplanPolicy>),
    Stay,
    Planner(Box<PlannerPolicy>),
    Lifelong(Box<LifelongPolicy>),
    Learned(Box<LearnedPolicy>),
}

impl NamedPolicy {
    /// Returns the names and descriptions of all policies. A name may stand for a one-shot and a lifelong planner.
    pub fn all() -> Vec<(&'static str, &'static str)> {
        fn listed<T: Words>() -> impl Iterator<Item = (&'static str, &'static str)> {
            T::WORDS.iter().map(|known| (known.word, known.help()))
        }
        let mut all: Vec<(&str, &str)> = Vec::new();
        let planners = listed::<PlannerName>().chain(listed::<LifelongName>());
        for (name, help) in listed::<SimplePolicy>().chain(planners).chain(listed::<LearnedName>()) {
            if !all.iter().any(|(known, _)| *known == name) {
                all.push((name, help));
            }
        }
        all
    }

    /// Returns whether a policy is a planner, which uses a budget.
    pub fn is_planner(name: &str) -> bool {
        PlannerName::of_word(name).is_some() || LifelongName::of_word(name).is_some()
    }

    /// Makes a policy by name for the episode of an instance; `random` draws from `generator`.
    ///
    /// The planner is lifelong if agents get new goals, or if no one-shot planner has this name.
    ///
    /// # Errors
    /// [`Error::Argument`] for an unknown name; [`Error::Request`] for a setting that the policy does not use, or for a
    /// learned policy without weights; those of [`Learned::begin`] for a learned policy.
    pub fn new(
        name: &str,
        settings: &PolicySettings,
        config: &pogema_core::Config,
        instance: &Instance,
        generator: Generator,
    ) -> Result<Self, Error> {
        let PolicySettings { budget, planner: planner_settings, future_goals, single_attempt, learned } =
            settings.clone();
        let all = Self::all();
        if !all.iter().any(|&(known, _)| known == name) {
            let known: Vec<_> = all.into_iter().map(|(known, _)| format!("`{known}`")).collect();
            return Err(Error::argument("policy", name, format!("one of {}", known.join(", "))));
        }
        let one_shot = PlannerName::of_word(name);
        let lifelong = LifelongName::of_word(name);
        let lifelong = lifelong.filter(|_| config.on_goal == OnGoal::Restart || one_shot.is_none());
        if future_goals && lifelong.is_none() {
            let reason = format!("`{name}` does not support `future_goals`; only lifelong planners do");
            return Err(Error::Request { reason });
        }
        if single_attempt && (lifelong.is_some() || one_shot.is_none()) {
            let reason = format!("`{name}` does not support a single attempt; only one-shot planners do");
            return Err(Error::Request { reason });
        }
        let name_of_learned = LearnedName::of_word(name);
        if name_of_learned.is_none() && learned.is_some() {
            return Err(Error::Request { reason: format!("`{name}` does not use weights") });
        }
        if let Some(name) = name_of_learned {
            let learned = learned.map_or_else(|| name.with_shipped_weights(), Ok)?;
            let PlannerSettings { seed, threads, .. } = planner_settings;
            let policy = learned.begin(instance, config, seed, threads, budget.cancelled)?;
            return Ok(Self(Kind::Learned(Box::new(policy))));
        }
        if let Some(planner) = lifelong {
            let mut policy = LifelongPolicy::new(planner, planner_settings, budget);
            if future_goals {
                policy.provide_future_goals(instance)?;
            }
            return Ok(Self(Kind::Lifelong(Box::new(policy))));
        }
        if let Some(planner) = one_shot {
            // If agents get new goals, no step exists by which all of them must be on their goals.
            let max_steps =
                u64::try_from(config.max_steps).ok().filter(|_| config.on_goal != OnGoal::Restart);
            let policy = PlannerPolicy::new(planner.make(planner_settings), budget, max_steps);
            let policy = if single_attempt { policy.with_single_attempt() } else { policy };
            return Ok(Self(Kind::Planner(Box::new(policy))));
        }
        Ok(Self(match SimplePolicy::read("policy", name)? {
            SimplePolicy::Random => Kind::Random(Box::new(generator)),
            SimplePolicy::Astar => Kind::Astar(pogema_team()),
            SimplePolicy::Replan => {
                Kind::Replan(Box::new(ReplanPolicy::begin(instance, config, planner_settings.seed)))
            }
            SimplePolicy::Stay => Kind::Stay,
        }))
    }

    /// Returns the outcome of the first call of a one-shot planner, whose problem is the whole episode.
    pub fn first_outcome(&self) -> Option<&Outcome> {
        match &self.0 {
            Kind::Planner(policy) => policy.first_outcome(),
            _ => None,
        }
    }

    /// Returns the time that a network has taken so far, as [`LearnedPolicy::network_time`] does; `None` for a policy
    /// without a network.
    pub fn network_time(&self) -> Option<Duration> {
        match &self.0 {
            Kind::Learned(policy) => Some(policy.network_time()),
            _ => None,
        }
    }

    /// Returns the actions of the next step.
    ///
    /// # Errors
    /// [`Error::NotReset`] before the start of the episode; those of [`PlannerPolicy::act`], [`LifelongPolicy::act`]
    /// and [`LearnedPolicy::act`] for such a policy; [`Error::OutOfStep`] if POGEMA's A* finds an agent more than one
    /// step away from its last cell.
    pub fn act<E: Environment>(&mut self, episode: &Episode<E>) -> Result<Vec<Action>, Error> {
        let (num_agents, map) = (episode.config().num_agents, episode.instance()?.map());
        match &mut self.0 {
            Kind::Random(generator) => Ok(sample(generator, num_agents)),
            Kind::Astar(team) => team.act(PomapfObservations::of(episode)?.each()),
            Kind::Replan(policy) => Ok(policy.act(episode.state())),
            Kind::Stay => Ok(vec![Action::Stay; num_agents]),
            Kind::Planner(policy) => policy.act(map, episode.state()),
            Kind::Lifelong(policy) => policy.act(map, episode.state()),
            Kind::Learned(policy) => policy.act(episode.state()),
        }
    }
}
