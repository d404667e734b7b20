//! The policy or file that chooses the actions.

use std::io::BufRead;
use std::path::Path;

use clap::builder::{PossibleValue, PossibleValuesParser};
use pogema_conformance::files;
use pogema_core::{Action, Environment, Episode, Error, InputLimit, Instance, Trace, counted, shorten};
use pogema_maps::{GridConfig, random_sequence};
use pogema_numpy::Generator;
use pogema_policies::{NamedPolicy, PolicySettings};

/// The name of the policy that reads actions from a file.
pub const FILE: &str = "file";

/// Returns a parser of the names of policies.
pub fn names() -> PossibleValuesParser {
    let all = NamedPolicy::all().into_iter().chain([(FILE, "Actions from a file")]);
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
        file: Option<(&Path, InputLimit)>,
        settings: &PolicySettings,
        config: &GridConfig,
        instance: &Instance,
    ) -> Result<Self, Error> {
        match (name, file) {
            (FILE, Some((path, limit))) => {
                Ok(Self::File(read_actions(path, limit, config.num_agents)?.into_iter()))
            }
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
        None => random_sequence().map(|sequence| Generator::from_sequence(&sequence)),
    }
}

/// Reads actions from a trace, or from a file with a list of numbers per line, one number per agent.
fn read_actions(path: &Path, limit: InputLimit, num_agents: usize) -> Result<Vec<Vec<Action>>, Error> {
    let failed = |error: std::io::Error| Error::io(path, error);
    let mut file = files::open_within(path, limit)?;
    if file.fill_buf().map_err(failed)?.first() == Some(&b'{') {
        let trace = Trace::read(file).map_err(|error| Error::io(path, error))?;
        let found = trace.header.starts.len();
        if found != num_agents {
            let reason = format!("the trace has {}, expected {num_agents}", counted(found, "agent"));
            return Err(Error::io(path, reason));
        }
        return Ok(trace.steps.into_iter().map(|step| step.actions).collect());
    }
    let mut steps = Vec::new();
    for (line, text) in (1_usize..).zip(file.lines()) {
        let text: String = text.map_err(|error| Error::io(path, format!("line {line}: {error}")))?;
        if !text.trim().is_empty() {
            let step = read_step(&text, num_agents);
            steps.push(step.map_err(|reason| Error::io(path, format!("line {line}: {reason}")))?);
        }
    }
    if steps.is_empty() {
        return Err(Error::io(path, "no actions, expected a trace or a list of action numbers per line"));
    }
    Ok(steps)
}

fn read_step(text: &str, num_agents: usize) -> Result<Vec<Action>, Error> {
    let numbers: Vec<i64> = serde_json::from_str(text).map_err(|_| {
        let found = shorten(text.trim(), Error::LONGEST_QUOTE);
        Error::request(format!("found `{found}`, expected a list of action numbers such as [0, 4]"))
    })?;
    Error::check_length("actions", num_agents, numbers.len())?;
    (0..).zip(numbers).map(|(agent, number)| Action::from_number(agent, number)).collect()
}
