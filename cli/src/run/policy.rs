//! The policy or file that chooses the actions.

use std::io::BufRead;
use std::path::Path;

use clap::builder::{PossibleValue, PossibleValuesParser};
use pogema_conformance::files;
use pogema_core::{Action, Environment, Episode, Error, Instance, Trace, shorten};
use pogema_maps::GridConfig;
use pogema_numpy::{Generator, SeedSequence};
use pogema_planners::{NamedPolicy, PolicySettings};

/// The name of the policy that reads actions from a file.
pub const FILE: &str = "file";

/// Returns a parser of the names of policies.
pub fn names() -> PossibleValuesParser {
    let all = NamedPolicy::all().into_iter().chain([(FILE, "actions from a file")]);
    PossibleValuesParser::new(all.map(|(name, help)| PossibleValue::new(name).help(help)))
}

/// A source of actions for one episode: a named policy, or a file.
pub enum ActionSource {
    Named(Box<NamedPolicy>),
    File(std::vec::IntoIter<Vec<Action>>),
}

impl ActionSource {
    /// Returns the named policy, or the actions of `file`, for one episode of an instance.
    pub fn new(
        name: &str,
        file: Option<&Path>,
        settings: &PolicySettings,
        config: &GridConfig,
        instance: &Instance,
    ) -> Result<Self, Error> {
        match (name, file) {
            (FILE, Some(path)) => Ok(Self::File(read_actions(path, config.num_agents)?.into_iter())),
            (FILE, None) => Err(Error::request("`--policy file` needs `--actions FILE`")),
            (_, Some(_)) => Err(Error::request("`--actions` needs `--policy file`")),
            (_, None) => {
                let (rules, dice) = (config.rules(), generator(config)?);
                let policy = NamedPolicy::new(name, settings, &rules, instance, dice)?;
                Ok(Self::Named(Box::new(policy)))
            }
        }
    }

    /// Returns the actions of the next step; `None` after the last one of a file.
    pub fn act<E: Environment>(&mut self, episode: &Episode<E>) -> Result<Option<Vec<Action>>, Error> {
        match self {
            Self::Named(policy) => policy.act(episode).map(Some),
            Self::File(steps) => Ok(steps.next()),
        }
    }
}

fn generator(config: &GridConfig) -> Result<Generator, Error> {
    match config.seed {
        Some(seed) => Ok(Generator::seeded(seed)),
        None => SeedSequence::from_os()
            .map(|sequence| Generator::from_sequence(&sequence))
            .map_err(|error| Error::external("random seed", error)),
    }
}

/// Reads actions from a trace, or from a file with a list of numbers per line, one number per agent.
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
        Error::request(format!("found `{found}`, expected a list of action numbers such as [0, 4]"))
    })?;
    Error::check_length("actions", num_agents, numbers.len())?;
    (0..).zip(numbers).map(|(agent, number)| Action::from_number(agent, number)).collect()
}
