//! The environments of a suite, one per episode.

use std::collections::{BTreeMap, BTreeSet};

use pogema_core::{Error, Map};
use pogema_maps::files::read_scenario;
use pogema_maps::formats::Scenario;
use pogema_maps::{GridConfig, Library, MapText, Targets};
use serde_json::{Map as Object, Value, json};

use crate::Pairs;
use crate::bounded::read_bounded;
use crate::groups::plain_text;
use crate::results::NUM_AGENTS;
use crate::suite::{Suite, TOOLBOX_FIELDS, is_pogema};
use crate::variants::{Variant, Variants};

/// The environments of a suite, each created on request.
#[derive(Clone, Debug)]
pub struct EpisodeConfigs {
    variants: Variants,
    library: Library,
    folder: std::path::PathBuf,
}

/// The field of a config with the maximum length of an episode.
const MAX_EPISODE_STEPS: &str = "max_episode_steps";

/// One episode of a suite: its config, and the values that distinguish it from the others.
#[derive(Clone, Debug)]
pub struct EpisodeConfig {
    /// The varied fields by the last key of their path, in the order of the file.
    pub changes: Pairs,
    /// The name of the chosen map, if `map_name` is given.
    pub map_name: Option<String>,
    /// The config of the episode.
    pub config: GridConfig,
}

impl EpisodeConfigs {
    /// Creates the environments of a suite, with the maps of a library, and checks them.
    ///
    /// # Errors
    /// One line with all missing maps. If no map is missing, one line about the first invalid environment among those
    /// that differ from environment 0 in at most one field.
    pub fn new(suite: &Suite, library: Library) -> Result<Self, Error> {
        let environments = Self::unchecked(suite, library);
        environments.check(suite).map(|()| environments)
    }

    /// Creates the environments of a suite without checks, for callers that build the environments themselves.
    pub fn unchecked(suite: &Suite, library: Library) -> Self {
        let folder = suite.folder().to_owned();
        Self { variants: suite.environments.clone(), library, folder }
    }

    fn check(&self, suite: &Suite) -> Result<(), Error> {
        self.check_maps().map_err(|error| suite.in_file(error))?;
        self.variants.probes().try_for_each(|(index, line)| {
            let with_line = |error: Error| {
                let of_field = error.field().and_then(|field| self.variants.line_of(field));
                let reason = format!("line {}: {error}", of_field.unwrap_or(line));
                suite.in_file(Error::request(reason))
            };
            self.at(index).map(|_| ()).map_err(with_line)
        })
    }

    /// Returns all fields of the environment at an index, as in the file.
    ///
    /// # Errors
    /// If the index is out of range.
    pub fn fields(&self, index: usize) -> Result<Object<String, Value>, Error> {
        self.variant(index).map(|variant| variant.fields)
    }

    fn variant(&self, index: usize) -> Result<Variant, Error> {
        let out_of_range = || Error::argument("episode", index, format!("below {}", self.len()));
        self.variants.at(index).ok_or_else(out_of_range)
    }

    /// Returns all fields of the environment at an index, with the number of agents and the step limit.
    ///
    /// If `map_name` holds a pattern, the name of the chosen map replaces it. A map, a scenario or POGEMA's default may
    /// set the number of agents.
    ///
    /// # Errors
    /// If the index is out of range.
    pub fn named_fields(&self, index: usize) -> Result<Object<String, Value>, Error> {
        let mut fields = self.fields(index)?;
        if let Ok(Some((name, _))) = self.map_of(&fields) {
            fields.insert("map_name".into(), name.into());
        }
        // For environments other than POGEMA's, these two numbers are unknown.
        if let Ok(EpisodeConfig { config, .. }) = self.at(index) {
            fields.insert(NUM_AGENTS.to_owned(), config.num_agents.into());
            fields.insert(MAX_EPISODE_STEPS.to_owned(), config.max_episode_steps.into());
        }
        Ok(fields)
    }

    /// Returns all fields of the environment at an index, with the starts and goals of its map or of its scenario, and
    /// without the scenario's file.
    ///
    /// # Errors
    /// If the index is out of range; if the environment has a scenario, or a map with starts, and is invalid.
    pub fn whole_fields(&self, index: usize) -> Result<Object<String, Value>, Error> {
        let mut fields = self.fields(index)?;
        let has_scenario = fields.get("scenario").is_some_and(|file| !file.is_null());
        let has_starts = matches!(self.map_of(&fields), Ok(Some((_, text))) if !text.starts.is_empty());
        if !is_pogema(fields.get("name")) || !has_scenario && !has_starts {
            return Ok(fields);
        }
        let config = self.at(index)?.config;
        fields.remove("scenario");
        fields.insert(NUM_AGENTS.to_owned(), config.num_agents.into());
        fields.insert("agents_xy".into(), json!(config.agents_xy));
        fields.insert("targets_xy".into(), json!(config.targets_xy));
        Ok(fields)
    }

    /// Returns the map that `map_name` and the seed of an environment choose; `None` if `use_maps` is false, or
    /// if `map_name` is missing or not a string.
    ///
    /// Source: pogema-toolbox 0.1.1, `create_env.py`, `MultiMapWrapper.reset`
    fn map_of(&self, fields: &Object<String, Value>) -> Result<Option<(&str, &MapText)>, Error> {
        if fields.get("use_maps") == Some(&Value::Bool(false)) {
            return Ok(None);
        }
        let seed = fields.get("seed").and_then(Value::as_u64).unwrap_or_default();
        let pattern = fields.get("map_name").and_then(Value::as_str);
        pattern.map(|pattern| self.library.named_or_chosen(pattern, seed)).transpose()
    }

    /// Returns the number of environments.
    pub fn len(&self) -> usize {
        self.variants.len()
    }

    /// Returns whether a field is varied over an empty list.
    pub fn is_empty(&self) -> bool {
        self.variants.is_empty()
    }

    /// Returns the environment at an index.
    ///
    /// # Errors
    /// If the index is out of range, or the environment is invalid.
    pub fn at(&self, index: usize) -> Result<EpisodeConfig, Error> {
        let Variant { changes, mut fields } = self.variant(index)?;
        let scenario = fields.get("scenario").cloned();
        if !is_pogema(fields.get("name")) {
            let name = fields.get("name").map_or_else(String::new, plain_text);
            return Err(Error::config("name", name, "`Environment`; other environments run only in Python"));
        }
        if fields.get("seed").and_then(Value::as_u64).is_none() {
            let given = fields.get("seed").map_or_else(|| "missing".into(), plain_text);
            let expected = "a whole number of 0 or more, so that results are reproducible";
            return Err(Error::config("seed", given, expected));
        }
        let map = self.map_of(&fields)?;
        for field in TOOLBOX_FIELDS {
            fields.remove(field);
        }
        let config = match map {
            Some((_, text)) => {
                fields.remove("map_name");
                GridConfig::on_map(&fields, text)?
            }
            None => GridConfig::from_value(&Value::Object(fields.clone()))?,
        };
        let config = match scenario.filter(|value| !value.is_null()) {
            Some(file) => {
                let scenario = self.scenario(&file, config.map.as_ref())?;
                config.with_scenario(&scenario, &fields)?
            }
            None => config,
        };
        let map_name = map.map(|(name, _)| name.to_owned());
        Ok(EpisodeConfig { changes, map_name, config })
    }

    /// Returns the varied fields of the environment at an index.
    ///
    /// # Errors
    /// If the index is out of range.
    pub fn changes(&self, index: usize) -> Result<Pairs, Error> {
        self.variant(index).map(|variant| variant.changes)
    }

    /// Sorts indices of environments by cost, highest first; equal costs keep their order.
    pub fn by_cost(&self, mut indices: Vec<usize>) -> Vec<usize> {
        indices.sort_by_cached_key(|&index| std::cmp::Reverse(self.cost(index)));
        indices
    }

    /// Returns an estimate of the work for an environment. Units: agent steps.
    fn cost(&self, index: usize) -> u64 {
        let number = |name: &str, otherwise: u64| {
            self.variants.value_at(index, name).and_then(Value::as_u64).unwrap_or(otherwise)
        };
        // Missing fields count as POGEMA's defaults, even if a map or scenario sets the number of agents.
        number(NUM_AGENTS, 1).saturating_mul(number(MAX_EPISODE_STEPS, 64))
    }

    /// Returns the content of the maps that each value of `map_name` selects, and of each scenario.
    pub(crate) fn inputs(&self) -> BTreeMap<String, Vec<u8>> {
        let texts = |field| self.variants.values_of(field).into_iter().filter_map(Value::as_str);
        let mut all = BTreeMap::new();
        for word in texts("map_name") {
            let names = match self.library.map(word) {
                Ok(_) => vec![word],
                Err(_) => self.library.matching(word).unwrap_or_default(),
            };
            // A map that only an environment in Python knows is not in the library.
            let maps = names.into_iter().filter_map(|name| Some((name, self.library.map(name).ok()?)));
            let maps: Vec<Value> = maps.map(|(name, text)| json!([name, content(text)])).collect();
            all.extend((!maps.is_empty()).then(|| (word.to_owned(), json!(maps).to_string().into_bytes())));
        }
        for file in texts("scenario") {
            // In an environment in Python, the field may hold anything.
            all.extend(read_bounded(&self.folder.join(file)).map(|bytes| (file.to_owned(), bytes)));
        }
        all
    }

    /// Returns the name and text of the map with a name, or of the map that a seed chooses for a pattern.
    ///
    /// The text omits the map's starts and goals, because text cannot represent two of them on one cell.
    /// [`EpisodeConfigs::whole_fields`] returns them.
    ///
    /// # Errors
    /// If there is no such map.
    pub fn map(&self, pattern: &str, seed: u64) -> Result<(String, String), Error> {
        let (name, text) = self.library.named_or_chosen(pattern, seed)?;
        let plain = MapText { starts: Vec::new(), goals: Targets::default(), ..text.clone() };
        Ok((name.to_owned(), plain.to_text()?))
    }

    fn scenario(&self, scenario: &Value, map: Option<&Map>) -> Result<Scenario, Error> {
        let file = scenario.as_str().ok_or_else(|| Error::config("scenario", scenario, "a file"))?;
        let map = map.ok_or_else(|| Error::config("scenario", file, "an environment with a map"))?;
        read_scenario(&self.folder.join(file), map)
    }

    /// Checks that there is a map for each name.
    fn check_maps(&self) -> Result<(), Error> {
        if self.variants.values_of("use_maps").contains(&&Value::Bool(false)) {
            return Ok(());
        }
        let names: BTreeSet<&str> =
            self.variants.values_of("map_name").into_iter().filter_map(Value::as_str).collect();
        let is_missing =
            |name: &&str| self.library.map(name).is_err() && self.library.matching(name).is_err();
        let missing: Vec<&str> = names.into_iter().filter(is_missing).collect();
        missing.iter().try_for_each(|pattern| Library::check_pattern(pattern))?;
        match missing[..] {
            [] => Ok(()),
            [name] => self.library.matching(name).map(|_| ()),
            _ => {
                let names: Vec<String> = missing.iter().map(|name| format!("`{name}`")).collect();
                let (number, names) = (missing.len(), names.join(", "));
                let expected = "names or patterns of known maps";
                Err(Error::request(format!(
                    "`map_name`: {number} unknown maps: {names}; expected {expected}"
                )))
            }
        }
    }
}

/// Returns everything that a map holds.
fn content(text: &MapText) -> Value {
    let fields = Scenario { starts: text.starts.clone(), goals: text.goals.clone() }.fields();
    json!([text.map.rows(), fields, text.pools])
}
