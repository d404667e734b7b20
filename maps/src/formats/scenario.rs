//! Starts and goals without a map, as in the benchmark's YAML files.

use pogema_core::{Cell, Error, Map, counted, rows_and_columns, shorten};
use serde_json::{Map as Object, Value, json};

use super::scen::Task;
use crate::config::{Targets, cells_of, read_targets, value_from_yaml};
use crate::source::check_on_map;

/// The start of each agent, and its goal or goal sequence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Scenario {
    /// The starts.
    pub starts: Vec<Cell>,
    /// The goals of the same number of agents.
    pub goals: Targets,
}

/// Checks that the number of starts equals the number of agents that have goals.
///
/// # Errors
/// [`Error::Config`] if the numbers differ.
pub(crate) fn check_equal_numbers(starts: &[Cell], goals: &Targets) -> Result<(), Error> {
    if starts.len() == goals.len() {
        return Ok(());
    }
    let expected = format!("goals of {}, as many as in agents_xy", counted(starts.len(), "agent"));
    let found = format!("goals of {}", counted(goals.len(), "agent"));
    Err(Error::config("targets_xy", found, expected))
}

impl Scenario {
    /// Creates a scenario from starts and goals.
    ///
    /// # Errors
    /// [`Error::Config`] if the numbers of starts and goals differ.
    pub fn new(starts: Vec<Cell>, goals: Targets) -> Result<Self, Error> {
        check_equal_numbers(&starts, &goals)?;
        Ok(Self { starts, goals })
    }

    /// Reads a YAML text with `agents_xy` and `targets_xy`; ignores other fields.
    ///
    /// # Errors
    /// [`Error::Syntax`] for invalid YAML, with line and column, and for a missing field, with its name;
    /// [`Error::Config`] for a field with a wrong value, or if the numbers of starts and goals differ.
    pub fn from_yaml(text: &str) -> Result<Self, Error> {
        let value = value_from_yaml(text)?;
        let field = |name: &str| {
            let given = value.get(name).filter(|value| !value.is_null());
            given.ok_or_else(|| Error::Syntax { reason: format!("missing field `{name}`") })
        };
        Self::new(cells_of("agents_xy", field("agents_xy")?)?, read_targets(field("targets_xy")?)?)
    }

    /// Creates a scenario from the tasks of a `.scen` file and their map.
    ///
    /// # Errors
    /// [`Error::Instance`] if the height or width that a task names differs from that of the map.
    pub fn from_tasks(tasks: &[Task], map: &Map) -> Result<Self, Error> {
        let sides = map.sides();
        if let Some(task) = tasks.iter().find(|task| (task.height, task.width) != sides) {
            let name = shorten(&task.map, Error::LONGEST_QUOTE);
            return Err(Error::instance(format!(
                "the tasks are for `{name}` with {}, but the map has {} and {}",
                rows_and_columns(task.height, task.width),
                sides.0,
                sides.1
            )));
        }
        let starts = tasks.iter().map(|task| task.start).collect();
        Ok(Self { starts, goals: Targets::Single(tasks.iter().map(|task| task.goal).collect()) })
    }

    /// Checks that all starts and goals are on a map.
    ///
    /// # Errors
    /// [`Error::CellOutside`] for the first cell off the map.
    pub fn check_on(&self, map: &Map) -> Result<(), Error> {
        check_on_map(map.sides(), "agents_xy", &self.starts)?;
        check_on_map(map.sides(), "targets_xy", &self.goals.all())
    }

    /// Returns the scenario of only the first agents.
    ///
    /// # Errors
    /// [`Error::Config`] if the scenario has fewer agents.
    pub fn truncated(&self, num_agents: usize) -> Result<Self, Error> {
        if num_agents > self.starts.len() {
            let expected = format!("at most {}, the number of agents in the scenario", self.starts.len());
            return Err(Error::config("num_agents", num_agents, expected));
        }
        let goals = match &self.goals {
            Targets::Single(goals) => Targets::Single(goals[..num_agents].to_vec()),
            Targets::Sequences(sequences) => Targets::Sequences(sequences[..num_agents].to_vec()),
        };
        Ok(Self { starts: self.starts[..num_agents].to_vec(), goals })
    }

    /// Returns the fields that describe the scenario in a config.
    pub fn fields(&self) -> Object<String, Value> {
        Object::from_iter([
            ("agents_xy".into(), json!(self.starts)),
            ("targets_xy".into(), json!(self.goals)),
        ])
    }
}
