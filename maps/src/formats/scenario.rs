//! Starts and goals without a map, as the benchmark's YAML files have them.

use pogema_core::{Cell, Error, Map, shorten};
use serde_json::{Map as Object, Value, json};

use super::scen::Task;
use crate::config::{Targets, cells_of, read_targets, value_from_yaml};
use crate::source::check_on_map;

/// Where each agent starts, and its goal or its goals one after the other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Scenario {
    /// The starts.
    pub starts: Vec<Cell>,
    /// The goals, of as many agents.
    pub goals: Targets,
}

impl Scenario {
    /// A scenario of as many starts as goals.
    ///
    /// # Errors
    /// [`Error::Config`] if they are not as many.
    pub fn new(starts: Vec<Cell>, goals: Targets) -> Result<Self, Error> {
        if starts.len() != goals.len() {
            let expected = format!("those of {} agents, as agents_xy has", starts.len());
            return Err(Error::config("targets_xy", format!("{} goals", goals.len()), expected));
        }
        Ok(Self { starts, goals })
    }

    /// Reads a YAML text with `agents_xy` and `targets_xy`; other fields are left to others.
    ///
    /// # Errors
    /// [`Error::Syntax`] with the place, or [`Error::Config`] with the field.
    pub fn from_yaml(text: &str) -> Result<Self, Error> {
        let value = value_from_yaml(text)?;
        let field = |name: &str| {
            let given = value.get(name).filter(|value| !value.is_null());
            given.ok_or_else(|| Error::Syntax { reason: format!("there is no field `{name}`") })
        };
        Self::new(cells_of("agents_xy", field("agents_xy")?)?, read_targets(field("targets_xy")?)?)
    }

    /// The tasks of a `.scen` file, as a scenario on their map.
    ///
    /// # Errors
    /// [`Error::Instance`] if the tasks are of a map of other sides.
    pub fn from_tasks(tasks: &[Task], map: &Map) -> Result<Self, Error> {
        let sides = (map.height(), map.width());
        if let Some(task) = tasks.iter().find(|task| (task.height, task.width) != sides) {
            let name = shorten(&task.map, Error::LONGEST_QUOTE);
            return Err(Error::instance(format!(
                "the tasks are of `{name}` with {} rows and {} columns, the map has {} and {}",
                task.height, task.width, sides.0, sides.1
            )));
        }
        let starts = tasks.iter().map(|task| task.start).collect();
        Ok(Self { starts, goals: Targets::Single(tasks.iter().map(|task| task.goal).collect()) })
    }

    /// Passes if all starts and goals are on a map.
    ///
    /// # Errors
    /// [`Error::Config`] about the first cell that is not.
    pub fn check_on(&self, map: &Map) -> Result<(), Error> {
        check_on_map(map, "agents_xy", &self.starts)?;
        check_on_map(map, "targets_xy", &self.goals.all())
    }

    /// The first agents alone.
    ///
    /// # Errors
    /// [`Error::Config`] if there are fewer.
    pub fn truncated(&self, num_agents: usize) -> Result<Self, Error> {
        if num_agents > self.starts.len() {
            let expected = format!("at most the {} of the scenario", self.starts.len());
            return Err(Error::config("num_agents", num_agents, expected));
        }
        let goals = match &self.goals {
            Targets::Single(goals) => Targets::Single(goals[..num_agents].to_vec()),
            Targets::Sequences(sequences) => Targets::Sequences(sequences[..num_agents].to_vec()),
        };
        Ok(Self { starts: self.starts[..num_agents].to_vec(), goals })
    }

    /// The fields that a config has for it.
    pub fn fields(&self) -> Object<String, Value> {
        Object::from_iter([
            ("agents_xy".into(), json!(self.starts)),
            ("targets_xy".into(), json!(self.goals)),
        ])
    }
}
