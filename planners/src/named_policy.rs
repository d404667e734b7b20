//! Policies by name: planners that drive an environment, and the simple ones.

use pogema_core::{Action, Environment, Episode, Error, Instance, OnGoal};
use pogema_numpy::Generator;

use crate::drawn::{pogema_team, sample};
use crate::windows::Windows;
use crate::{AStarTeam, Budget, Choice, LIFELONG, LifelongPolicy, PLANNERS, PlannerPolicy, planner};

/// Names of policies that plan for nobody else, each with what it does.
pub const SIMPLE: [(&str, &str); 3] = [
    ("random", "what POGEMA's `sample_actions` draws"),
    ("astar", "POGEMA's own A* agent, one for each agent"),
    ("stay", "nobody moves"),
];

/// What a policy is made with, besides its name.
#[derive(Clone, Debug, Default)]
pub struct PolicySettings {
    /// How long a planner may think of one plan.
    pub budget: Budget,
    /// Seed and threads of a planner.
    pub choice: Choice,
    /// Whether a lifelong planner is told of the goals that are still to come, too.
    pub future_goals: bool,
}

/// Anything that chooses the actions of all agents of one episode, by its name.
pub struct NamedPolicy(Kind);

enum Kind {
    Random(Box<Generator>),
    Astar(AStarTeam),
    Stay,
    Planner(Box<PlannerPolicy>),
    Lifelong(Box<LifelongPolicy>),
}

impl NamedPolicy {
    /// The names of all policies, each with what it is good for; some are both planners for one goal and lifelong.
    pub fn all() -> Vec<(&'static str, &'static str)> {
        let mut all: Vec<(&str, &str)> = Vec::new();
        for (name, help) in SIMPLE.into_iter().chain(PLANNERS).chain(LIFELONG) {
            if !all.iter().any(|(known, _)| *known == name) {
                all.push((name, help));
            }
        }
        all
    }

    /// The policy of a name for the episode of an instance; `dice` is what `random` draws from.
    ///
    /// A planner is one for agents that get goal after goal if they do, or if there is no other of the name.
    ///
    /// # Errors
    /// For a name that is unknown; for goals to come that the policy cannot be told of.
    pub fn new(
        name: &str,
        settings: &PolicySettings,
        config: &pogema_core::Config,
        instance: &Instance,
        dice: Generator,
    ) -> Result<Self, Error> {
        let has = |known: &[(&str, &str)]| known.iter().any(|(known, _)| *known == name);
        let PolicySettings { budget, choice, future_goals } = settings.clone();
        let is_lifelong = has(&LIFELONG) && (config.on_goal == OnGoal::Restart || !has(&PLANNERS));
        if future_goals && !is_lifelong {
            let reason = format!("`{name}` cannot be told of goals to come, only lifelong planners can");
            return Err(Error::State { reason });
        }
        Ok(Self(match name {
            "random" => Kind::Random(Box::new(dice)),
            "astar" => Kind::Astar(pogema_team()),
            "stay" => Kind::Stay,
            name if is_lifelong => {
                let mut policy = LifelongPolicy::new(name, choice, budget)?;
                if future_goals {
                    policy.foresee(instance)?;
                }
                Kind::Lifelong(Box::new(policy))
            }
            name => {
                let most_steps = u64::try_from(config.max_steps).ok();
                Kind::Planner(Box::new(PlannerPolicy::new(planner(name, choice)?, budget, most_steps)))
            }
        }))
    }

    /// The actions of the next step.
    ///
    /// # Errors
    /// Before the start of the episode.
    pub fn act<E: Environment>(&mut self, episode: &Episode<E>) -> Result<Vec<Action>, Error> {
        let (num_agents, map) = (episode.config().num_agents, episode.instance()?.map());
        match &mut self.0 {
            Kind::Random(generator) => Ok(sample(generator, num_agents)),
            Kind::Astar(team) => team.act(Windows::of(episode)?.views()),
            Kind::Stay => Ok(vec![Action::Stay; num_agents]),
            Kind::Planner(policy) => policy.act(map, episode.state()),
            Kind::Lifelong(policy) => policy.act(map, episode.state()),
        }
    }
}
