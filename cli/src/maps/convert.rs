//! `pogema maps import`, `export` and `tiles`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use pogema_core::Error;
use pogema_maps::files::{MovingAiOptions, read_maps, read_scenario};
use pogema_maps::formats::{
    NamedMap, Scenario, Task, Water, write_archive, write_movingai, write_scen, write_set,
};
use pogema_maps::{MapText, PUBLISHED_TILE, Targets, distances_to, tiles};
use serde_json::{Value, json};

use super::{Sources, ambiguous_map, number_of_agents, write_out};
use crate::output::{check_writable, with_flag};
use crate::words::word;

#[derive(Args, Debug)]
pub struct Import {
    /// MovingAI maps (.map), zip archives (.zip), map texts (.txt), map sets and configs (.yaml), or folders of those
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// Whether agents may enter MovingAI's water
    #[arg(long, default_value_t, value_parser = word::<Water>())]
    water: Water,
    /// Remove the outermost rows and columns of MovingAI maps, as pogema-toolbox does
    #[arg(long)]
    strip_border: bool,
    /// Write to this file instead of standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Import {
    pub fn run(&self) -> Result<(), Error> {
        let options = MovingAiOptions { water: self.water, strips_border: self.strip_border };
        let mut maps: Vec<NamedMap> = Vec::new();
        for path in &self.paths {
            for map in read_maps(path, options)? {
                if maps.iter().any(|other| other.name == map.name) {
                    return Err(Error::io(path, format!("a second map named `{}`", map.name)));
                }
                maps.push(map);
            }
        }
        write_out(self.out.as_deref(), write_set(&maps)?.as_bytes())
    }
}

#[derive(Args, Debug)]
pub struct Export {
    /// Map to export: a name, a pattern of names, a file or a folder
    map: String,
    #[command(flatten)]
    sources: Sources,
    /// Output format
    #[arg(long, value_enum)]
    to: Format,
    /// Starts and goals: a .scen file, or a YAML file with `agents_xy` and `targets_xy`
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Export only the first N agents of the scenario [default: all]
    #[arg(long, value_name = "N", requires = "scenario", value_parser = number_of_agents())]
    num_agents: Option<usize>,
    /// Write to this file instead of standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Map set in YAML
    Set,
    /// Map text
    Text,
    /// MovingAI .map file, without starts and goals; `scen` writes those
    Map,
    /// MovingAI .scen file: starts and goals only
    Scen,
    /// Config for `pogema run` and POGEMA
    Config,
    /// Zip archive of .map files
    Zip,
}

impl Export {
    pub fn run(&self) -> Result<(), Error> {
        let mut maps = self.sources.resolve(&self.map)?;
        if let Some(path) = &self.scenario {
            let [map] = maps.as_mut_slice() else {
                return Err(ambiguous_map(&self.map, maps.len(), "for a scenario"));
            };
            if matches!(self.to, Format::Map | Format::Zip) {
                let to = if self.to == Format::Map { "map" } else { "zip" };
                return Err(Error::request(format!(
                    "`--scenario` has no effect with `--to {to}`, which holds no starts and goals; `--to scen` writes those"
                )));
            }
            let scenario = read_scenario(path, &map.text.map)?;
            let num_agents = self.num_agents.unwrap_or(scenario.starts.len());
            let scenario = scenario.truncated(num_agents)?;
            if matches!(scenario.goals, Targets::Sequences(_)) && self.to != Format::Config {
                return Err(Error::request(
                    "the scenario has goal sequences, which only `--to config` supports",
                ));
            }
            if self.to == Format::Config {
                let text = config(&map.text, Some(&scenario))?;
                return write_out(self.out.as_deref(), text.as_bytes());
            }
            (map.text.starts, map.text.goals) = (scenario.starts, scenario.goals);
        }
        let bytes = self.bytes(&maps)?;
        write_out(self.out.as_deref(), &bytes)
    }

    fn bytes(&self, maps: &[NamedMap]) -> Result<Vec<u8>, Error> {
        let written = match (self.to, maps) {
            (Format::Set, _) => write_set(maps)?,
            (Format::Zip, _) => {
                return write_archive(maps.iter().map(|map| (map.name.as_str(), &map.text.map)));
            }
            (Format::Text, [map]) => map.text.to_text()? + "\n",
            (Format::Map, [map]) => write_movingai(&map.text.map),
            (Format::Scen, [map]) => write_scen(&tasks(&map.name, &map.text)?)?,
            (Format::Config, [map]) => config(&map.text, None)?,
            _ => return Err(ambiguous_map(&self.map, maps.len(), "for this format")),
        };
        Ok(written.into_bytes())
    }
}

/// Converts the starts and goals of a map to tasks of a .scen file.
fn tasks(name: &str, text: &MapText) -> Result<Vec<Task>, Error> {
    let Scenario { starts, goals: Targets::Single(goals) } =
        Scenario::new(text.starts.clone(), text.goals.clone())?
    else {
        return Err(Error::config("targets_xy", "goal sequences", "one goal per agent in a .scen file"));
    };
    if starts.is_empty() {
        let expected = "a map with starts and goals, or `--scenario FILE`";
        return Err(Error::request(format!("`{name}` has no starts and goals, expected {expected}")));
    }
    let task = |(agent, (&start, &goal))| {
        let steps = distances_to(&text.map, goal)[text.map.index(start)];
        if steps == u32::MAX {
            return Err(Error::agent(
                agent,
                "has no path to its goal, but a .scen file requires the path length",
            ));
        }
        Ok(Task {
            bucket: u64::from(steps) / 4,
            map: format!("{name}.map"),
            height: text.map.height(),
            width: text.map.width(),
            start,
            goal,
            length: f64::from(steps),
        })
    };
    starts.iter().zip(&goals).enumerate().map(task).collect()
}

/// Formats a config as YAML, the map drawn row by row. Pools that a map text cannot express become fields.
fn config(text: &MapText, scenario: Option<&Scenario>) -> Result<String, Error> {
    let mut lines = vec!["map: |-".to_owned()];
    let plain = MapText { starts: Vec::new(), goals: Targets::default(), ..text.clone() };
    let (rows, pools) = match plain.rows() {
        Ok(rows) => (rows, None),
        Err(_) => (plain.map.rows(), plain.pools),
    };
    lines.extend(rows.iter().map(|row| format!("  {row}")));
    let own = Scenario::new(text.starts.clone(), text.goals.clone())?;
    let scenario = scenario.or((!own.starts.is_empty()).then_some(&own));
    let mut fields = scenario.map(Scenario::fields).unwrap_or_default();
    if let Some((starts, goals)) = pools {
        fields.insert("possible_agents_xy".into(), json!(starts));
        fields.insert("possible_targets_xy".into(), json!(goals));
    }
    for (field, value) in fields {
        lines.push(format!("{field}: {}", flow_yaml(&value)));
    }
    Ok(lines.join("\n") + "\n")
}

/// Formats a value as JSON, which is valid YAML, with a space after each comma.
fn flow_yaml(value: &Value) -> String {
    match value {
        Value::Array(items) => format!("[{}]", items.iter().map(flow_yaml).collect::<Vec<_>>().join(", ")),
        other => json!(other).to_string(),
    }
}

#[derive(Args, Debug)]
pub struct Tiles {
    /// Map to cut: a name, a pattern of names, a file or a folder
    map: String,
    #[command(flatten)]
    sources: Sources,
    /// Side length of the tiles
    #[arg(long, value_name = "N", default_value_t = PUBLISHED_TILE)]
    side: usize,
    /// Write to this file instead of standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Tiles {
    pub fn run(&self) -> Result<(), Error> {
        self.out.as_deref().map_or(Ok(()), check_writable)?;
        let cut = |map: NamedMap| -> Result<Vec<NamedMap>, Error> {
            if !map.text.starts.is_empty() || map.text.pools.is_some() {
                let reason = format!("`{}` has starts and goals, which would be lost in tiles", map.name);
                return Err(Error::request(reason));
            }
            tiles(&map.name, &map.text.map, self.side).map_err(with_flag)
        };
        let mut all = Vec::new();
        for map in self.sources.resolve(&self.map)? {
            all.extend(cut(map)?);
        }
        write_out(self.out.as_deref(), write_set(&all)?.as_bytes())
    }
}
