//! The config of a run: a file and flags that override it.

use std::path::{Path, PathBuf};

use clap::Args;
use pogema_core::{Collision, Error, Map, OnGoal, Words, rows_and_columns};
use pogema_maps::files::{MovingAiOptions, read_maps, read_scenario, read_text};
use pogema_maps::formats::NamedMap;
use pogema_maps::{
    FIELDS, Generated, GridConfig, InstanceSource, Library, MapText, did_you_mean, random_sequence,
};
use pogema_numpy::Generator;
use serde_json::{Map as Object, Number, Value};

use crate::maps::{Sources, no_such_file};
use crate::output::tell_warnings;
use crate::words::word;

#[derive(Args, Debug)]
pub struct Settings {
    /// Config file with POGEMA's fields, in YAML or JSON
    config: Option<PathBuf>,
    /// Name of a map, pattern of names from which the seed chooses one, or file with a map [default: from the config,
    /// else a random map]
    #[arg(long, value_name = "NAME|PATTERN|FILE")]
    map: Option<String>,
    #[command(flatten)]
    sources: Sources,
    /// Starts and goals: a .scen file, or a YAML file with `agents_xy` and `targets_xy`
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Seed of the map, starts, goals and random actions [default: from the config, else a new one in each run]
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Number of agents [default: from the config, map, scenario or plan, else 1]
    #[arg(long, value_name = "N")]
    num_agents: Option<u64>,
    /// Side length of a random map [default: from the config, else 8]
    #[arg(long, value_name = "N")]
    size: Option<u64>,
    /// Share of obstacles of a random map [default: from the config, else 0.3]
    #[arg(long, value_name = "P")]
    density: Option<f64>,
    /// Observation radius: how many cells agents see in each direction [default: from the config, else 5]
    #[arg(long, value_name = "R")]
    obs_radius: Option<u64>,
    /// Maximum number of steps of the episode [default: from the config, else 64; for `pogema plan` and `pogema
    /// validate`, no limit]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    steps: Option<i64>,
    /// Effect of reaching a goal [default: from the config, else finish]
    #[arg(long, value_parser = word::<OnGoal>())]
    on_target: Option<OnGoal>,
    /// Collision system, which resolves conflicting moves [default: from the config, else priority]
    #[arg(long, value_parser = word::<Collision>())]
    collision_system: Option<Collision>,
    /// Set any other field of the config, such as `empty_outside=false`; may be given several times
    #[arg(long = "set", value_name = "FIELD=VALUE")]
    others: Vec<String>,
}

impl Settings {
    /// Returns the map or config as it was given, and the seed.
    pub fn title(&self) -> Option<String> {
        let config = || self.config.as_ref().map(|path| path.display().to_string());
        self.map.clone().or_else(config).map(|name| match self.seed {
            Some(seed) => format!("{name}, seed {seed}"),
            None => name,
        })
    }

    /// Returns the map as it was given.
    pub fn map_argument(&self) -> Option<&str> {
        self.map.as_deref()
    }

    /// Returns the files that the settings name. The name or pattern of a map is included as if it were a file.
    pub fn inputs(&self) -> Vec<&Path> {
        let files = [self.config.as_deref(), self.scenario.as_deref(), self.map.as_deref().map(Path::new)];
        files.into_iter().flatten().chain(self.sources.paths().iter().map(PathBuf::as_path)).collect()
    }

    /// Returns the maximum number of steps of a plan, if a flag or the file sets it.
    pub fn max_steps(&self) -> Result<Option<usize>, Error> {
        let Some(given) = self.fields()?.get("max_episode_steps").and_then(Value::as_i64) else {
            return Ok(None);
        };
        let within = usize::try_from(given).ok().filter(|&steps| steps > 0);
        let wrong = || Error::config("max_episode_steps", given, "at least 1 for a plan");
        within.map(Some).ok_or_else(|| self.located(wrong()))
    }

    /// Returns the only map that a name, pattern or file selects.
    pub fn map_named(&self, word: &str) -> Result<Map, Error> {
        Ok(only_map(word, self.sources.resolve(word)?)?.map)
    }

    /// Returns the config from the file and the flags.
    pub fn config(&self) -> Result<GridConfig, Error> {
        self.config_for(None)
    }

    /// Returns the config with a number of agents, unless the file or a flag sets another one.
    pub fn config_for(&self, num_agents: Option<usize>) -> Result<GridConfig, Error> {
        self.read(num_agents).map_err(|error| self.located(error))
    }

    /// Generates the instance of a config from [`Settings::config`], and prints the warnings.
    pub fn generate(&self, config: &GridConfig) -> Result<Generated, Error> {
        let generated = InstanceSource::new(config.clone(), None).and_then(|mut source| source.generate());
        let generated = generated.map_err(|error| self.located(error))?;
        tell_warnings(&generated.warnings);
        Ok(generated)
    }

    /// Adds to an error the flag or the file that caused it.
    fn located(&self, error: Error) -> Error {
        let flags = self.flags().unwrap_or_default();
        let field = match &error {
            Error::Map { .. } | Error::UnknownCharacter { .. } => Some("map"),
            error => error.field(),
        };
        let flag = flags.into_iter().find(|(name, ..)| field == Some(name));
        let path = match (&error, &self.scenario) {
            (Error::Agent { .. }, Some(scenario)) => Some(scenario),
            _ => self.config.as_ref(),
        };
        match (error, flag, path) {
            (Error::Config { value, expected, .. }, Some((_, flag, _)), _) => {
                Error::argument(&flag, value, expected)
            }
            (Error::CellOutside { cell, height, width, .. }, Some((_, flag, _)), _) => {
                let expected = format!("cells inside the map of {}", rows_and_columns(height, width));
                Error::argument(&flag, cell, expected)
            }
            (error @ (Error::Map { .. } | Error::UnknownCharacter { .. }), Some((_, flag, _)), _) => {
                Error::request(format!("`{flag}`: {error}"))
            }
            (error @ (Error::Io { .. } | Error::Argument { .. }), ..) => error,
            (error, None, Some(path)) => Error::io(path, error),
            (error, ..) => error,
        }
    }

    /// Returns the fields that flags set: name, flag and value.
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
                let expected = format!("a config field{}", did_you_mean(field, FIELDS));
                return Err(Error::argument("--set", field, expected));
            }
            Ok((field.to_owned(), format!("--set {field}"), value_of(value)))
        });
        let flags: Vec<(String, String, Value)> = plain.chain(others).collect::<Result<_, Error>>()?;
        for (index, (field, flag, value)) in flags.iter().enumerate() {
            if let Some((_, other, _)) = flags[..index].iter().find(|(earlier, ..)| earlier == field) {
                let expected = format!("no value, because `{other}` sets `{field}`, too");
                return Err(Error::argument(flag, value, expected));
            }
        }
        Ok(flags)
    }

    /// Returns the fields of the file, overridden by those of the flags.
    fn fields(&self) -> Result<Object<String, Value>, Error> {
        let mut fields = match &self.config {
            Some(path) => read_fields(path)?,
            None => Object::new(),
        };
        let flags = self.flags()?;
        if flags.iter().any(|(field, ..)| field == "size") {
            fields.remove("width");
            fields.remove("height");
        }
        fields.extend(flags.into_iter().map(|(field, _, value)| (field, value)));
        Ok(fields)
    }

    /// Checks that no flag describes a random map in addition to the given map.
    fn check_unused(&self) -> Result<(), Error> {
        let is_unused = |field: &str| ["size", "width", "height", "density"].contains(&field);
        match self.flags()?.into_iter().find(|(field, ..)| is_unused(field)) {
            Some((_, flag, value)) => Err(Error::argument(&flag, value, "no value, because a map is given")),
            None => Ok(()),
        }
    }

    fn read(&self, num_agents: Option<usize>) -> Result<GridConfig, Error> {
        let mut fields = self.fields()?;
        if let Some(num_agents) = num_agents.filter(|_| fields.get("num_agents").is_none_or(Value::is_null)) {
            fields.insert("num_agents".into(), num_agents.into());
        }
        let map = self.chosen_map(&mut fields)?;
        if map.is_some() || fields.get("map").is_some_and(|map| !map.is_null()) {
            self.check_unused()?;
        }
        let config = match map {
            Some(text) => GridConfig::on_map(&fields, &text)?,
            None => GridConfig::from_value(&Value::Object(fields.clone()))?,
        };
        let Some(path) = &self.scenario else { return Ok(config) };
        let map = config.map.as_ref().ok_or_else(|| Error::request("`--scenario` needs a map"))?;
        let scenario = read_scenario(path, map)?;
        config.with_scenario(&scenario, &fields).map_err(|error| match error.field() {
            Some("agents_xy" | "targets_xy") => Error::io(path, error.reason()),
            _ => error,
        })
    }

    /// Removes the map name from the fields and returns the map that the flag or the name selects.
    ///
    /// Source: pogema-toolbox 0.1.1, `create_env.py`, `MultiMapWrapper.reset`
    fn chosen_map(&self, fields: &mut Object<String, Value>) -> Result<Option<MapText>, Error> {
        let named = fields.get("map_name").and_then(Value::as_str).map(str::to_owned);
        // A value that is not a string stays, so that the config rejects it.
        if named.is_some() {
            fields.remove("map_name");
        }
        let Some(word) = self.map.clone().or(named) else { return Ok(None) };
        let library = self.sources.library(Some(&word))?;
        let text = if let Ok(text) = library.map(&word) {
            text.clone()
        } else if self.map.is_some() && Path::new(&word).exists() {
            only_map(&word, read_maps(Path::new(&word), MovingAiOptions::default())?)?
        } else {
            let seed = fields.get("seed").and_then(Value::as_u64);
            chosen(&library, &word, seed).map_err(|error| match &self.map {
                Some(_) => no_such_file(&word, &error),
                None => error,
            })?
        };
        Ok(Some(text))
    }
}

/// Returns the only map of a file.
pub fn only_map(word: &str, maps: Vec<NamedMap>) -> Result<MapText, Error> {
    let found = maps.len();
    let mut maps = maps.into_iter();
    match (maps.next(), maps.next()) {
        (Some(map), None) => Ok(map.text),
        _ => Err(Error::io(
            word,
            format!("found {found} maps, expected one; choose one with `--maps {word} --map NAME`"),
        )),
    }
}

/// Returns the matching map that the seed, or a random number, chooses.
fn chosen(library: &Library, pattern: &str, seed: Option<u64>) -> Result<MapText, Error> {
    if let Some(seed) = seed {
        return library.choose(pattern, seed).map(|(_, text)| text.clone());
    }
    let names = library.matching(pattern)?;
    let index =
        Generator::from_sequence(&random_sequence()?).integers(0, names.len() as i64).unwrap_or_default();
    library.map(names[index as usize]).cloned()
}

/// Converts a number to JSON. NaN and infinities, which JSON would turn into null, become strings, which the config
/// rejects.
fn number(value: f64) -> Value {
    Number::from_f64(value).map_or_else(|| value.to_string().into(), Value::Number)
}

fn value_of(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|_| text.into())
}

fn read_fields(path: &Path) -> Result<Object<String, Value>, Error> {
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
