//! Policies by name.

use pogema_core::{Action, Environment, Episode, Error, Instance, OnGoal};
use pogema_numpy::Generator;

use crate::budget::Budget;
use crate::outcome::Outcome;
use crate::policies::astar::AStarTeam;
use crate::policies::lifelong_policy::LifelongPolicy;
use crate::policies::observations::PomapfObservations;
use crate::policies::planner_policy::PlannerPolicy;
use crate::policies::pogema::{pogema_team, sample};
use crate::registry::{LIFELONG, PLANNERS, PlannerSettings, planner};

/// The names and descriptions of policies without a joint plan.
pub const SIMPLE: [(&str, &str); 3] = [
    ("random", "what POGEMA's `sample_actions` draws"),
    ("astar", "POGEMA's own A* agent, one for each agent"),
    ("stay", "all agents stay"),
];

/// The settings of a policy.
#[derive(Clone, Debug, Default)]
pub struct PolicySettings {
    /// The budget of one plan.
    pub budget: Budget,
    /// Settings of the planner.
    pub planner: PlannerSettings,
    /// Whether a lifelong planner knows future goals.
    pub future_goals: bool,
    /// Whether a one-shot planner that finds no plan is not called again in that episode.
    pub single_attempt: bool,
}

/// A policy for all agents of one episode, made by name.
pub struct NamedPolicy(Kind);

enum Kind {
    Random(Box<Generator>),
    Astar(AStarTeam),
    Stay,
    Planner(Box<PlannerPolicy>),
    Lifelong(Box<LifelongPolicy>),
}

impl NamedPolicy {
    /// Returns the names and descriptions of all policies. A name may stand for a one-shot and a lifelong planner.
    pub fn all() -> Vec<(&'static str, &'static str)> {
        let mut all: Vec<(&str, &str)> = Vec::new();
        for (name, help) in SIMPLE.into_iter().chain(PLANNERS).chain(LIFELONG) {
            if !all.iter().any(|(known, _)| *known == name) {
                all.push((name, help));
            }
        }
        all
    }

    /// Makes the policy of a name for the episode of an instance; `random` draws from `generator`.
    ///
    /// A planner is lifelong if agents get new goals, or if there is no one-shot planner of the name.
    ///
    /// # Errors
    /// [`Error::Config`] for an unknown name; [`Error::Request`] for a setting that the policy does not use.
    pub fn new(
        name: &str,
        settings: &PolicySettings,
        config: &pogema_core::Config,
        instance: &Instance,
        generator: Generator,
    ) -> Result<Self, Error> {
        let has = |known: &[(&str, &str)]| known.iter().any(|(known, _)| *known == name);
        let PolicySettings { budget, planner: planner_settings, future_goals, single_attempt } =
            settings.clone();
        let is_lifelong = has(&LIFELONG) && (config.on_goal == OnGoal::Restart || !has(&PLANNERS));
        if future_goals && !is_lifelong {
            let reason = format!("`{name}` does not use future goals; only lifelong planners do");
            return Err(Error::Request { reason });
        }
        if single_attempt && (is_lifelong || !has(&PLANNERS)) {
            let reason = format!("`{name}` does not use a single attempt; only one-shot planners do");
            return Err(Error::Request { reason });
        }
        Ok(Self(match name {
            "random" => Kind::Random(Box::new(generator)),
            "astar" => Kind::Astar(pogema_team()),
            "stay" => Kind::Stay,
            name if is_lifelong => {
                let mut policy = LifelongPolicy::new(name, planner_settings, budget)?;
                if future_goals {
                    policy.provide_future_goals(instance)?;
                }
                Kind::Lifelong(Box::new(policy))
            }
            name => {
                let max_steps = u64::try_from(config.max_steps).ok();
                let policy = PlannerPolicy::new(planner(name, planner_settings)?, budget, max_steps);
                Kind::Planner(Box::new(if single_attempt { policy.with_single_attempt() } else { policy }))
            }
        }))
    }

    /// Returns the outcome of the first call of a one-shot planner, whose problem is the whole episode.
    pub fn first_outcome(&self) -> Option<&Outcome> {
        match &self.0 {
            Kind::Planner(policy) => policy.outcomes().first(),
            _ => None,
        }
    }

    /// Returns the actions of the next step.
    ///
    /// # Errors
    /// Before the start of the episode.
    pub fn act<E: Environment>(&mut self, episode: &Episode<E>) -> Result<Vec<Action>, Error> {
        let (num_agents, map) = (episode.config().num_agents, episode.instance()?.map());
        match &mut self.0 {
            Kind::Random(generator) => Ok(sample(generator, num_agents)),
            Kind::Astar(team) => team.act(PomapfObservations::of(episode)?.each()),
            Kind::Stay => Ok(vec![Action::Stay; num_agents]),
            Kind::Planner(policy) => policy.act(map, episode.state()),
            Kind::Lifelong(policy) => policy.act(map, episode.state()),
        }
    }
}
