//! The paper's sets of instances.

use std::path::Path;

use pogema_core::Error;
use pogema_maps::GridConfig;
use pogema_maps::files::{Reading, read_maps};
use pogema_maps::formats::NamedMap;
use serde_json::json;

/// What the agents of an episode have to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Setting {
    /// Each has one goal, where it stays
    Mapf,
    /// Each gets goal after goal
    Lmapf,
}

impl Setting {
    /// As the published tables name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mapf => "MAPF",
            Self::Lmapf => "LMAPF",
        }
    }
}

/// A set of the paper: which maps, with how many agents and which seeds.
pub struct Set {
    /// As the published tables name it; the file of its maps has this name too.
    pub name: &'static str,
    num_agents: &'static [usize],
    num_seeds: u64,
    most_steps: [u64; 2],
    /// How many maps of the file belong to it.
    num_maps: usize,
}

/// Source: the configs published with the paper's results, one for each set.
pub const SETS: [Set; 6] = [
    Set {
        name: "01-random",
        num_agents: &[8, 16, 24, 32, 48, 64],
        num_seeds: 1,
        most_steps: [128, 256],
        num_maps: 128,
    },
    Set {
        name: "02-mazes",
        num_agents: &[8, 16, 24, 32, 48, 64],
        num_seeds: 1,
        most_steps: [128, 128],
        num_maps: 128,
    },
    Set {
        name: "03-warehouse",
        num_agents: &[32, 64, 96, 128, 160, 192],
        num_seeds: 128,
        most_steps: [128, 256],
        num_maps: 1,
    },
    Set {
        name: "04-movingai",
        num_agents: &[64, 128, 192, 256],
        num_seeds: 1,
        most_steps: [256, 256],
        num_maps: 128,
    },
    Set { name: "05-puzzles", num_agents: &[2, 3, 4], num_seeds: 10, most_steps: [128, 256], num_maps: 16 },
    Set { name: "06-pathfinding", num_agents: &[1], num_seeds: 10, most_steps: [2048, 2048], num_maps: 8 },
];

/// One episode of a set.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Task {
    pub set: &'static str,
    pub num_agents: usize,
    pub map: String,
    pub seed: u64,
}

impl Set {
    /// The maps of the set, from a folder with one file for each set.
    pub fn maps(&self, folder: &Path) -> Result<Vec<NamedMap>, Error> {
        let path = folder.join(format!("{}.yaml", self.name));
        let maps = read_maps(&path, Reading::default())?;
        if maps.len() != self.num_maps {
            let reason = format!("{} maps, expected the {} of the paper", maps.len(), self.num_maps);
            return Err(Error::io(&path, reason));
        }
        Ok(maps)
    }

    /// The sizes of its crowds.
    pub fn num_agents(&self) -> &'static [usize] {
        self.num_agents
    }

    /// All episodes of one crowd; of those that follow each other only each `every`th.
    pub fn tasks(&self, maps: &[NamedMap], num_agents: usize, every: usize) -> Vec<Task> {
        let task = |map: &NamedMap, seed| Task { set: self.name, num_agents, map: map.name.clone(), seed };
        let of_map = |map| (0..self.num_seeds).map(move |seed| task(map, seed));
        maps.iter().flat_map(of_map).step_by(every).collect()
    }

    /// The config of an episode.
    pub fn config(&self, setting: Setting, task: &Task, maps: &[NamedMap]) -> Result<GridConfig, Error> {
        let (on_target, most_steps) = match setting {
            Setting::Mapf => ("nothing", self.most_steps[0]),
            Setting::Lmapf => ("restart", self.most_steps[1]),
        };
        let mut fields = json!({
            "num_agents": task.num_agents, "seed": task.seed, "max_episode_steps": most_steps,
            "on_target": on_target, "collision_system": "soft",
        });
        let map = maps.iter().find(|map| map.name == task.map);
        let map = map.ok_or_else(|| Error::Request { reason: format!("no map `{}`", task.map) })?;
        GridConfig::on_map(fields.as_object_mut().unwrap_or(&mut serde_json::Map::new()), &map.text)
    }
}
