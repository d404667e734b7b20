//! The config of a run: a file, and flags that override it.

use std::path::{Path, PathBuf};

use clap::Args;
use pogema_core::{Collision, Error, Map, OnGoal, Words};
use pogema_maps::files::{Reading, read_maps, read_scenario, read_text};
use pogema_maps::formats::NamedMap;
use pogema_maps::{FIELDS, Generated, GridConfig, InstanceSource, Library, MapText, nearest};
use pogema_numpy::{Generator, SeedSequence};
use serde_json::{Map as Object, Number, Value};

use crate::maps::Sources;
use crate::words::word;

#[derive(Args, Debug)]
pub struct Settings {
    /// A config file with POGEMA's fields, YAML or JSON
    config: Option<PathBuf>,
    /// A named map, a pattern of names among which the seed chooses, or a file with a map
    #[arg(long, value_name = "NAME|PATTERN|FILE")]
    map: Option<String>,
    #[command(flatten)]
    sources: Sources,
    /// Starts and goals: a .scen file, or YAML with `agents_xy` and `targets_xy`
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Seed of everything that is drawn
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Number of agents
    #[arg(long, value_name = "N")]
    num_agents: Option<u64>,
    /// Side of a drawn map
    #[arg(long, value_name = "N")]
    size: Option<u64>,
    /// Share of obstacles of a drawn map
    #[arg(long, value_name = "P")]
    density: Option<f64>,
    /// How far agents see
    #[arg(long, value_name = "R")]
    obs_radius: Option<u64>,
    /// Most steps of the episode
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    steps: Option<i64>,
    /// What reaching a goal does
    #[arg(long, value_parser = word::<OnGoal>())]
    on_target: Option<OnGoal>,
    /// How conflicts are resolved
    #[arg(long, value_parser = word::<Collision>())]
    collision_system: Option<Collision>,
    /// Any other field, such as `empty_outside=false`
    #[arg(long = "set", value_name = "FIELD=VALUE")]
    others: Vec<String>,
}

impl Settings {
    /// The map or config that was asked for, and the seed.
    pub fn what(&self) -> Option<String> {
        self.map_word().map(|name| match self.seed {
            Some(seed) => format!("{name}, seed {seed}"),
            None => name,
        })
    }

    /// The map or config that was asked for, as it was written.
    pub fn map_word(&self) -> Option<String> {
        self.map.clone().or_else(|| self.config.as_ref().map(|path| path.display().to_string()))
    }

    /// Whether a map is asked for.
    pub fn has_map(&self) -> bool {
        self.map.is_some() || self.config.is_some()
    }

    /// Most steps of an episode, if flags or file say so.
    pub fn most_steps(&self) -> Result<Option<i64>, Error> {
        let fields = self.config.as_deref().map(fields_of).transpose()?;
        let told = fields.and_then(|fields| fields.get("max_episode_steps").and_then(Value::as_i64));
        Ok(self.steps.or(told))
    }

    /// The map that is asked for, or drawn.
    pub fn map(&self) -> Result<Map, Error> {
        let config = self.config()?;
        match &config.map {
            Some(map) => Ok(map.clone()),
            None => Ok(self.generate(&config)?.instance.map().clone()),
        }
    }

    /// The config that file and flags make together.
    pub fn config(&self) -> Result<GridConfig, Error> {
        self.config_for(None)
    }

    /// The same for a number of agents, unless file or flags set another one.
    pub fn config_for(&self, num_agents: Option<usize>) -> Result<GridConfig, Error> {
        self.read(num_agents).map_err(|error| self.located(error))
    }

    /// The instance of a config that [`Settings::config`] made, and warnings about it.
    pub fn generate(&self, config: &GridConfig) -> Result<Generated, Error> {
        let generated = InstanceSource::new(config.clone(), None).and_then(|mut source| source.generate());
        generated.map_err(|error| self.located(error))
    }

    /// An error with the flag or the file that it comes from.
    fn located(&self, error: Error) -> Error {
        let flags = self.flags().unwrap_or_default();
        let field = match &error {
            Error::Map { .. } | Error::UnknownLetter { .. } => Some("map"),
            error => error.field(),
        };
        let flag = flags.into_iter().find(|(name, ..)| field == Some(name));
        match (error, flag, &self.config) {
            (Error::Config { value, expected, .. }, Some((_, flag, _)), _) => {
                Error::argument(&flag, value, expected)
            }
            (Error::CellOutside { cell, height, width, .. }, Some((_, flag, _)), _) => {
                let expected = format!("cells inside the map of {height} rows and {width} columns");
                Error::argument(&flag, cell, expected)
            }
            (error @ (Error::Io { .. } | Error::Argument { .. }), ..) => error,
            (error, None, Some(path)) => Error::io(path, error),
            (error, ..) => error,
        }
    }

    /// The fields that flags set, each with its flag.
    fn flags(&self) -> Result<Vec<(String, String, Value)>, Error> {
        let plain: [(&str, &str, Option<Value>); 8] = [
            ("seed", "--seed", self.seed.map(Into::into)),
            ("num_agents", "--num-agents", self.num_agents.map(Into::into)),
            ("size", "--size", self.size.map(Into::into)),
            ("density", "--density", self.density.map(number)),
            ("obs_radius", "--obs-radius", self.obs_radius.map(Into::into)),
            ("max_episode_steps", "--steps", self.steps.map(Into::into)),
            ("on_target", "--on-target", self.on_target.map(|word| word.word().into())),
            ("collision_system", "--collision-system", self.collision_system.map(|word| word.word().into())),
        ];
        let plain = plain
            .into_iter()
            .filter_map(|(field, flag, value)| Some(Ok((field.to_owned(), flag.to_owned(), value?))));
        let others = self.others.iter().map(|other| {
            let (field, value) = other.split_once('=').ok_or_else(|| {
                Error::argument("--set", other, "FIELD=VALUE, such as `empty_outside=false`")
            })?;
            if !FIELDS.contains(&field) {
                let hint = nearest(field, FIELDS).unwrap_or_default();
                let expected = format!("a field of a config; the nearest is `{hint}`");
                return Err(Error::argument("--set", field, expected));
            }
            Ok((field.to_owned(), format!("--set {field}"), value_of(value)))
        });
        plain.chain(others).collect()
    }

    fn read(&self, num_agents: Option<usize>) -> Result<GridConfig, Error> {
        let mut fields = match &self.config {
            Some(path) => fields_of(path)?,
            None => Object::new(),
        };
        fields.extend(self.flags()?.into_iter().map(|(field, _, value)| (field, value)));
        if let Some(num_agents) = num_agents {
            fields.entry("num_agents").or_insert(num_agents.into());
        }
        if self.size.is_some() {
            fields.remove("width");
            fields.remove("height");
        }
        let map = self.chosen_map(&mut fields)?;
        let config = match map {
            Some(text) => GridConfig::on_map(&fields, &text)?,
            None => GridConfig::from_value(&Value::Object(fields.clone()))?,
        };
        let Some(path) = &self.scenario else { return Ok(config) };
        let map = config.map.as_ref().ok_or_else(|| Error::request("`--scenario` needs a map"))?;
        let scenario = read_scenario(path, map)?;
        config.with_scenario(&scenario, &fields)
    }

    /// Takes the name of a map out of the fields, and returns the map that flag or name ask for.
    ///
    /// Source: pogema-toolbox 0.1.1, `create_env.py`, `MultiMapWrapper.reset`
    fn chosen_map(&self, fields: &mut Object<String, Value>) -> Result<Option<MapText>, Error> {
        let named = fields.get("map_name").and_then(Value::as_str).map(str::to_owned);
        // What is no text is left for the config to refuse.
        if named.is_some() {
            fields.remove("map_name");
        }
        let Some(word) = self.map.clone().or(named) else { return Ok(None) };
        let library = self.sources.library()?;
        let text = if let Ok(text) = library.map(&word) {
            text.clone()
        } else if self.map.is_some() && Path::new(&word).exists() {
            the_one(&word, read_maps(Path::new(&word), Reading::default())?)?
        } else {
            let seed = fields.get("seed").and_then(Value::as_u64);
            chosen(&library, &word, seed).map_err(|error| match &self.map {
                Some(_) => Error::io(&word, format!("there is no such file; {error}")),
                None => error,
            })?
        };
        Ok(Some(text))
    }
}

/// The only map of a file.
fn the_one(word: &str, maps: Vec<NamedMap>) -> Result<MapText, Error> {
    let found = maps.len();
    let mut maps = maps.into_iter();
    match (maps.next(), maps.next()) {
        (Some(map), None) => Ok(map.text),
        _ => Err(Error::io(word, format!("{found} maps, expected one; `--maps {word} --map NAME` chooses"))),
    }
}

/// The map that a seed, or chance, chooses among those that match.
fn chosen(library: &Library, pattern: &str, seed: Option<u64>) -> Result<MapText, Error> {
    if let Some(seed) = seed {
        return library.choose(pattern, seed).map(|(_, text)| text.clone());
    }
    let names = library.matching(pattern)?;
    let chance = SeedSequence::from_os().map_err(|error| Error::external("random seed", error))?;
    let index = Generator::from_sequence(&chance).integers(0, names.len() as i64).unwrap_or_default();
    library.map(names[index as usize]).cloned()
}

/// JSON has no NaN and would make it null, so it is left to the config to refuse the word.
fn number(value: f64) -> Value {
    Number::from_f64(value).map_or_else(|| value.to_string().into(), Value::Number)
}

fn value_of(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|_| text.into())
}

fn fields_of(path: &Path) -> Result<Object<String, Value>, Error> {
    let text = read_text(path)?;
    let is_json = path.extension().is_some_and(|ending| ending == "json");
    let value =
        if is_json { pogema_maps::value_from_json(&text) } else { pogema_maps::value_from_yaml(&text) };
    match value.map_err(|error| Error::io(path, error))? {
        Value::Object(fields) => Ok(fields),
        Value::Null => Ok(Object::new()),
        _ => Err(Error::io(path, "expected fields and values such as `size: 8`")),
    }
}
