//! Follower-lite against recordings of its authors' C++ code.

use std::collections::HashSet;
use std::path::Path;

use pogema_core::{Action, Cell, Episode};
use pogema_fast::Engine;
use pogema_maps::{GridConfig, InstanceSource, Library};
use pogema_policies::{Encoder, EncoderSettings, FollowerVersion};

use crate::common::recorded::{Array, arrays, folder};

/// A recorded episode.
pub struct Recorded {
    pub name: String,
    pub cells: Vec<i8>,
    pub goals: Vec<i8>,
    pub actions: Vec<i8>,
    pub num_agents: usize,
}

impl Recorded {
    /// Reads all recorded episodes.
    pub fn all(folder: &Path) -> Vec<Self> {
        let arrays = arrays(&folder.join("traces-follower-lite.npz"));
        let names = arrays.keys().filter_map(|name| name.strip_suffix("|action"));
        let of = |name: &str| {
            let array = |field: &str| -> &Array { &arrays[&format!("{name}|{field}")] };
            Self {
                name: name.to_owned(),
                cells: array("xy").i8(),
                goals: array("goal").i8(),
                actions: array("action").i8(),
                num_agents: array("action").shape[1],
            }
        };
        names.map(of).collect()
    }

    /// Starts the same episode.
    pub fn start(&self) -> Episode<Engine> {
        let map_name = self.name.split('|').nth(1).unwrap();
        let mut library = Library::built_in();
        library.add_published([map_name]).unwrap();
        let fields = serde_json::json!({
            "on_target": "restart", "max_episode_steps": 256, "collision_system": "soft",
            "observation_type": "MAPF", "seed": 0, "num_agents": self.num_agents,
        });
        let config = GridConfig::on_map(fields.as_object().unwrap(), library.map(map_name).unwrap()).unwrap();
        let mut episode = Episode::new(Engine::new(config.rules()).unwrap());
        episode.start(InstanceSource::new(config, None).unwrap().generate().unwrap().instance).unwrap();
        episode
    }

    /// Returns the actions of a step.
    pub fn actions(&self, step: usize) -> Vec<Action> {
        let numbers = &self.actions[step * self.num_agents..][..self.num_agents];
        numbers.iter().map(|&number| Action::try_from(i64::from(number)).unwrap()).collect()
    }

    /// Returns the cells or goals of a step; those of the file are counted from the border of width 5.
    pub fn places(&self, places: &[i8], step: usize) -> Vec<Cell> {
        let pairs = places[step * self.num_agents * 2..][..self.num_agents * 2].chunks(2);
        pairs.map(|pair| Cell::new(pair[0] as u16 - 5, pair[1] as u16 - 5)).collect()
    }
}

#[test]
fn recorded_inputs_are_those_of_the_encoder() {
    let Some(folder) = folder("recorded_inputs_are_those_of_the_encoder") else { return };
    let mut seen: HashSet<Vec<i8>> = HashSet::new();
    for recorded in Recorded::all(&folder) {
        let mut episode = recorded.start();
        let settings = EncoderSettings::follower(3, FollowerVersion::Cpp);
        let mut windows = vec![0.0; recorded.num_agents * settings.window_len()];
        let mut encoder = Encoder::new(settings).unwrap();
        let instance = episode.instance().unwrap();
        encoder.begin(instance.map(), instance.outside(), episode.config().occupancy, instance.starts());
        for step in 0..256 {
            let state = episode.state();
            assert_eq!(state.cells, recorded.places(&recorded.cells, step), "{}, step {step}", recorded.name);
            assert_eq!(state.goals, recorded.places(&recorded.goals, step), "{}, step {step}", recorded.name);
            encoder.encode(state, &mut windows, &mut []).unwrap();
            seen.extend(windows.chunks(98).map(|window| window.iter().map(|&value| value as i8).collect()));
            episode.step(&recorded.actions(step)).unwrap();
        }
    }
    let inputs = arrays(&folder.join("logits-follower-lite.npz")).remove("inputs").unwrap().i8();
    let missing = inputs.chunks(98).filter(|&input| !seen.contains(input)).count();
    assert_eq!(missing, 0, "of {} recorded inputs, the encoder never gave {missing}", inputs.len() / 98);
}
