//! Follower-lite against recordings of its authors' C++ code.

use std::path::Path;

use pogema_core::{Action, Cell, Episode};
use pogema_fast::Engine;
use pogema_maps::{GridConfig, InstanceSource, Library};
use pogema_policies::{Learned, LearnedName, Sampling};

use crate::common::recorded::{Array, arrays, folder};
use crate::common::weights::follower_lite;

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
fn recorded_episodes_are_played_action_for_action() {
    let Some(folder) = folder("recorded_episodes_are_played_action_for_action") else { return };
    let files = tempfile::tempdir().unwrap();
    let weights = follower_lite(&folder.join("follower-lite.onnx"), files.path());
    let learned = LearnedName::Follower.read(&weights).unwrap();
    let Learned::Network(learned) = learned.with_sampling(Sampling::Follower).unwrap() else {
        panic!("Follower is no search");
    };
    let mut different = Vec::new();
    for recorded in Recorded::all(&folder) {
        let mut episode = recorded.start();
        let mut policy = learned.begin(episode.instance().unwrap(), episode.config(), 0).unwrap();
        for step in 0..256 {
            let state = episode.state();
            assert_eq!(state.cells, recorded.places(&recorded.cells, step), "{}, step {step}", recorded.name);
            assert_eq!(state.goals, recorded.places(&recorded.goals, step), "{}, step {step}", recorded.name);
            let actions = policy.act(state).unwrap();
            if let Some(agent) = recorded.actions(step).iter().zip(&actions).position(|(a, b)| a != b) {
                let expected = recorded.actions(step)[agent];
                different.push((recorded.name.clone(), step, agent, expected, actions[agent]));
                break;
            }
            episode.step(&actions).unwrap();
        }
    }
    assert!(different.is_empty(), "episode, step, agent, recorded and chosen action: {different:#?}");
}
