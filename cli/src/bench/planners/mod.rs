//! `pogema bench planners`: the paper's instances, solved here, beside the published figures.

mod play;
mod published;
mod speed;
mod suite;
mod table;

use std::collections::HashMap;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use pogema_core::Error;
use pogema_maps::files::read_text;
use pogema_maps::formats::NamedMap;
use serde::{Deserialize, Serialize};

use crate::output::say;
use crate::plan::Thinking;

use published::{Published, Solved, solved};
use suite::{SETS, Set, Setting, Task};

#[derive(Args, Debug)]
pub struct Planners {
    /// A folder with the paper's maps, one file for each set
    #[arg(long, value_name = "FOLDER")]
    suite: PathBuf,
    /// One goal for each agent, or goal after goal
    #[arg(long, value_enum, default_value_t = Setting::Mapf)]
    setting: Setting,
    /// Who plans; by default `lacam` for one goal and `rhcr` for many
    #[arg(long, value_name = "NAME")]
    planner: Option<String>,
    #[command(flatten)]
    thinking: Thinking,
    /// Tell the planner also of the goals that are still to come
    #[arg(long)]
    future_goals: bool,
    /// Only the sets whose names contain this
    #[arg(long, value_name = "TEXT", default_value = "")]
    sets: String,
    /// Only crowds of so many agents
    #[arg(long, value_name = "N")]
    num_agents: Option<usize>,
    /// Only each Nth episode of a crowd
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    every: u64,
    /// A look only: each 64th episode
    #[arg(long, conflicts_with = "every")]
    quick: bool,
    /// Measure instead how long a first plan takes, and how many steps PIBT makes
    #[arg(
        long,
        conflicts_with_all = [
            "setting", "planner", "sets", "num_agents", "records", "published", "episodes", "seconds", "nodes",
            "threads", "planner_seed", "future_goals",
        ]
    )]
    speed: bool,
    /// The published means, a table with commas
    #[arg(long, value_name = "FILE")]
    published: Option<PathBuf>,
    /// The published episodes: a folder with one for each set, holding `LaCAM.json`
    #[arg(long, value_name = "FOLDER")]
    episodes: Option<PathBuf>,
    /// Keep every episode in this file as JSON lines; those that it holds already are not played again
    #[arg(long, value_name = "FILE")]
    records: Option<PathBuf>,
}

/// One episode that was played.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Record {
    setting: String,
    planner: String,
    thinking: Thinking,
    #[serde(default)]
    future_goals: bool,
    set: String,
    num_agents: usize,
    map: String,
    seed: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    csr: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    soc: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    makespan: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    throughput: Option<f64>,
    /// Units: seconds.
    runtime: f64,
    /// The least that any plan's sum of costs can be, as far as the planner knows.
    #[serde(skip_serializing_if = "Option::is_none")]
    bound: Option<u64>,
    /// What a proof says about an episode that was not solved.
    #[serde(skip_serializing_if = "Option::is_none")]
    impossible: Option<String>,
}

impl Record {
    /// The sum of costs of an episode that was solved.
    fn solved_soc(&self) -> Option<f64> {
        self.soc.filter(|_| self.csr == Some(1.0))
    }
}

impl Planners {
    pub fn run(&self) -> Result<(), Error> {
        if self.future_goals && self.setting == Setting::Mapf {
            return Err(Error::config("future-goals", "true", "`--setting lmapf`"));
        }
        let every = if self.quick { 64 } else { self.every as usize };
        if self.speed {
            return self.tell_speed(every);
        }
        let published = self.published.as_deref().map(Published::read).transpose()?;
        let mut known = self.known()?;
        let sets: Vec<&Set> = SETS.iter().filter(|set| set.name.contains(&self.sets)).collect();
        if sets.is_empty() {
            return Err(Error::config("sets", &self.sets, "a part of a set's name, such as `mazes`"));
        }
        let mut crowds = Vec::new();
        for set in sets {
            let maps = set.maps(&self.suite)?;
            let solved = self.solved(set, &maps)?;
            for &num_agents in set.num_agents() {
                if self.num_agents.is_some_and(|wanted| wanted != num_agents) {
                    continue;
                }
                let tasks = set.tasks(&maps, num_agents, every);
                let records = self.crowd(set, &maps, tasks, &mut known)?;
                let algorithm = match self.setting {
                    Setting::Mapf => "LaCAM",
                    Setting::Lmapf => "RHCR",
                };
                let mean = published.as_ref();
                let mean =
                    mean.and_then(|all| all.mean(self.setting, set.name, algorithm, num_agents)).cloned();
                crowds.push(table::Crowd {
                    set: set.name,
                    num_agents,
                    records,
                    mean,
                    solved: solved.clone(),
                });
            }
        }
        let mut planner = self.planner().to_owned();
        if self.future_goals {
            planner.push_str(" told of future goals");
        }
        say(&table::tell(self.setting, &planner, &self.thinking, &crowds))
    }

    fn tell_speed(&self, every: usize) -> Result<(), Error> {
        let crowds = |name: &str, num_agents: usize| {
            let set = SETS.iter().find(|set| set.name == name);
            let set = set.ok_or_else(|| Error::config("set", name, "one of the paper's"))?;
            Ok(speed::Crowds { set, maps: set.maps(&self.suite)?, num_agents })
        };
        let (squares, cities) = (crowds("04-movingai", 256)?, crowds("06-pathfinding", 1000)?);
        say(&speed::table(&squares, &cities, &crowds("03-warehouse", 192)?, every)?.to_string())
    }

    fn planner(&self) -> &str {
        self.planner.as_deref().unwrap_or(match self.setting {
            Setting::Mapf => "lacam",
            Setting::Lmapf => "rhcr",
        })
    }

    /// Plays what is not known yet of a crowd; returns all of it.
    fn crowd(
        &self,
        set: &Set,
        maps: &[NamedMap],
        tasks: Vec<Task>,
        known: &mut HashMap<Task, Record>,
    ) -> Result<Vec<Record>, Error> {
        let style = ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}, {eta} left");
        let bar = ProgressBar::new(tasks.len() as u64);
        let bar = style.map_or(bar.clone(), |style| bar.with_style(style));
        let agents = tasks.first().map_or(0, |task| task.num_agents);
        bar.set_message(format!("{}, {agents} agents", set.name));
        let mut records = Vec::with_capacity(tasks.len());
        for task in tasks {
            let record = match known.remove(&task) {
                Some(record) => record,
                None => self.keep(self.play(set, maps, &task)?)?,
            };
            records.push(record);
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(records)
    }

    fn play(&self, set: &Set, maps: &[NamedMap], task: &Task) -> Result<Record, Error> {
        let config = set.config(self.setting, task, maps)?;
        let in_task = |error: Error| Error::Request {
            reason: format!(
                "{} {} seed {}, {} agents: {error}",
                task.set, task.map, task.seed, task.num_agents
            ),
        };
        let played = match self.setting {
            Setting::Mapf => play::play_once(&config, self.planner(), &self.thinking),
            Setting::Lmapf => play::play_on(&config, self.planner(), &self.thinking, self.future_goals),
        };
        let played = played.map_err(in_task)?;
        Ok(Record {
            setting: self.setting.name().to_owned(),
            planner: self.planner().to_owned(),
            thinking: self.thinking.clone(),
            future_goals: self.future_goals,
            set: set.name.to_owned(),
            num_agents: task.num_agents,
            map: task.map.clone(),
            seed: task.seed,
            csr: played.metrics.csr,
            soc: played.metrics.soc,
            makespan: played.metrics.makespan,
            throughput: played.metrics.avg_throughput,
            runtime: played.runtime.as_secs_f64(),
            bound: played.bound,
            impossible: played.impossible,
        })
    }

    /// The records of an earlier run that was asked the same. What that run wrote last may have been cut off with
    /// it, and is taken off the file.
    fn known(&self) -> Result<HashMap<Task, Record>, Error> {
        let Some(path) = self.records.as_deref().filter(|path| path.exists()) else {
            return Ok(HashMap::new());
        };
        let text = read_text(path)?;
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        if whole < text.len() {
            let file = OpenOptions::new().write(true).open(path);
            let shorten = file.and_then(|file| file.set_len(whole as u64));
            shorten.map_err(|error| Error::io(path, error))?;
        }
        let mut known = HashMap::new();
        for line in text[..whole].lines() {
            let record: Record = serde_json::from_str(line).map_err(|error| Error::io(path, error))?;
            let is_same = record.setting == self.setting.name()
                && record.planner == self.planner()
                && record.thinking == self.thinking
                && record.future_goals == self.future_goals;
            let set = SETS.iter().find(|set| set.name == record.set);
            if let Some(set) = set.filter(|_| is_same) {
                let (num_agents, map, seed) = (record.num_agents, record.map.clone(), record.seed);
                known.insert(Task { set: set.name, num_agents, map, seed }, record);
            }
        }
        Ok(known)
    }

    fn keep(&self, record: Record) -> Result<Record, Error> {
        let Some(path) = &self.records else { return Ok(record) };
        let failed = |error: std::io::Error| Error::io(path, error);
        let line = serde_json::to_string(&record).map_err(|error| Error::io(path, error))?;
        let mut file = OpenOptions::new().create(true).append(true).open(path).map_err(failed)?;
        file.write_all(format!("{line}\n").as_bytes()).map_err(failed)?;
        Ok(record)
    }

    fn solved(&self, set: &Set, maps: &[NamedMap]) -> Result<Option<Solved>, Error> {
        let Some(folder) = self.episodes.as_deref().filter(|_| self.setting == Setting::Mapf) else {
            return Ok(None);
        };
        let path = folder.join(set.name).join("LaCAM.json");
        let only_map = (maps.len() == 1).then(|| maps[0].name.as_str());
        solved(&path, only_map).map(Some)
    }
}
