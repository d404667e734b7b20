//! Who chooses the actions.

use std::io::BufRead;
use std::path::Path;

use clap::ValueEnum;
use pogema_conformance::{files, pogema_team, sample};
use pogema_core::{Action, Error, Instance, OnGoal, Trace, shorten};
use pogema_maps::GridConfig;
use pogema_maps::numpy::{Generator, SeedSequence};
use pogema_planners::{AStarTeam, LIFELONG, LifelongPolicy, PLANNERS, PlannerPolicy, planner};

use crate::plan::Thinking;

use super::episode::Episode;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PolicyName {
    /// What POGEMA's `sample_actions` draws
    Random,
    /// POGEMA's own A* agent, one for each agent
    Astar,
    /// Nobody moves
    Stay,
    /// LaCAM*, which plans for all agents at once
    Lacam,
    /// PIBT, which decides step by step and promises nothing
    Pibt,
    /// PIBT around the traffic, for agents that get goal after goal
    GuidedPibt,
    /// Priority-based search, for all agents at once
    Pbs,
    /// Bounded-suboptimal conflict-based search, for all agents at once
    Ecbs,
    /// Optimal conflict-based search, for all agents at once
    Cbs,
    /// Rolling-horizon planning, for agents that get goal after goal
    Rhcr,
    /// Actions from a file
    File,
}

impl std::fmt::Display for PolicyName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let value = self.to_possible_value();
        f.write_str(value.as_ref().map_or("", clap::builder::PossibleValue::get_name))
    }
}

/// A policy at work.
pub enum Policy {
    Random(Box<Generator>),
    Astar(AStarTeam),
    Stay,
    Planner(Box<PlannerPolicy>),
    Lifelong(Box<LifelongPolicy>),
    File(std::vec::IntoIter<Vec<Action>>),
}

impl Policy {
    pub fn new(
        name: PolicyName,
        file: Option<&Path>,
        thinking: &Thinking,
        config: &GridConfig,
    ) -> Result<Self, Error> {
        match (name, file) {
            (PolicyName::File, Some(path)) => {
                Ok(Self::File(read_actions(path, config.num_agents)?.into_iter()))
            }
            (PolicyName::File, None) => {
                Err(Error::State { reason: "`--policy file` needs `--actions FILE`".into() })
            }
            (_, Some(_)) => Err(Error::State { reason: "`--actions` needs `--policy file`".into() }),
            (PolicyName::Random, None) => Ok(Self::Random(Box::new(generator(config)?))),
            (PolicyName::Astar, None) => Ok(Self::Astar(pogema_team())),
            (PolicyName::Stay, None) => Ok(Self::Stay),
            (_, None) => Self::planned(&name.to_string(), thinking, config),
        }
    }

    /// A planner: one for agents that get goal after goal if they do, or if there is no other of the name.
    fn planned(name: &str, thinking: &Thinking, config: &GridConfig) -> Result<Self, Error> {
        let has = |known: &[(&str, &str)]| known.iter().any(|(known, _)| *known == name);
        let is_lifelong = config.rules().on_goal == OnGoal::Restart;
        if has(&LIFELONG) && (is_lifelong || !has(&PLANNERS)) {
            let policy = LifelongPolicy::new(name, thinking.choice(), thinking.budget()?)?;
            return Ok(Self::Lifelong(Box::new(policy)));
        }
        let planner = planner(name, thinking.choice())?;
        let most_steps = u64::try_from(config.max_episode_steps).ok();
        Ok(Self::Planner(Box::new(PlannerPolicy::new(planner, thinking.budget()?, most_steps))))
    }

    /// Tells a planner also of the goals that are still to come.
    pub fn foresee(&mut self, instance: &Instance) -> Result<(), Error> {
        match self {
            Self::Lifelong(policy) => policy.foresee(instance),
            _ => Err(Error::State {
                reason: "`--future-goals` needs `--policy rhcr` and agents that get goal after goal".into(),
            }),
        }
    }

    /// The actions of the next step; none when a file has no more.
    pub fn act(&mut self, episode: &Episode) -> Result<Option<Vec<Action>>, Error> {
        let num_agents = episode.config().num_agents;
        Ok(match self {
            Self::Random(generator) => Some(sample(generator, num_agents)),
            Self::Astar(team) => Some(episode.ask(team)?),
            Self::Stay => Some(vec![Action::Stay; num_agents]),
            Self::Planner(policy) => Some(policy.act(episode.ground().map, &episode.snapshot())?),
            Self::Lifelong(policy) => Some(policy.act(episode.ground().map, &episode.snapshot())?),
            Self::File(steps) => steps.next(),
        })
    }
}

fn generator(config: &GridConfig) -> Result<Generator, Error> {
    match config.seed {
        Some(seed) => Ok(Generator::seeded(seed)),
        None => SeedSequence::from_os()
            .map(|sequence| Generator::from_sequence(&sequence))
            .map_err(|error| Error::State { reason: error.to_string() }),
    }
}

/// The actions of a trace, or of a file with a list of numbers per line, as many as there are agents.
fn read_actions(path: &Path, num_agents: usize) -> Result<Vec<Vec<Action>>, Error> {
    let failed = |error: std::io::Error| Error::io(path, error);
    let lines: Vec<String> = files::open(path)?.lines().collect::<Result<_, _>>().map_err(failed)?;
    if lines.first().is_some_and(|line| line.starts_with('{')) {
        let trace = Trace::read(lines.join("\n").as_bytes()).map_err(|error| Error::io(path, error))?;
        Error::check_length("actions", num_agents, trace.header.starts.len())
            .map_err(|error| Error::io(path, error))?;
        return Ok(trace.steps.into_iter().map(|step| step.actions).collect());
    }
    let texts = (1..).zip(&lines).filter(|(_, text)| !text.trim().is_empty());
    let read = |(line, text): (usize, &String)| {
        read_step(text, num_agents).map_err(|reason| Error::io(path, format!("line {line}: {reason}")))
    };
    texts.map(read).collect()
}

fn read_step(text: &str, num_agents: usize) -> Result<Vec<Action>, Error> {
    let numbers: Vec<i64> = serde_json::from_str(text).map_err(|_| {
        let found = shorten(text.trim(), Error::LONGEST_QUOTE);
        Error::State { reason: format!("found `{found}`, expected a list of action numbers such as [0, 4]") }
    })?;
    Error::check_length("actions", num_agents, numbers.len())?;
    (0..).zip(numbers).map(|(agent, number)| Action::from_number(agent, number)).collect()
}
