//! Follower-lite against recordings of its authors' C++ code.

use std::path::Path;

use pogema_core::{Action, Cell, Episode};
use pogema_fast::Engine;
use pogema_maps::{GridConfig, InstanceSource, Library};
use pogema_policies::{LearnedName, Sampling};

use crate::recorded::{read_array, weights};

/// A recorded episode.
struct Recorded {
    name: String,
    cells: Vec<f32>,
    goals: Vec<f32>,
    actions: Vec<f32>,
    num_agents: usize,
}

impl Recorded {
    /// Reads the twelve episodes.
    fn all(folder: &Path) -> Vec<Self> {
        let path = folder.join("traces-follower-lite.npz");
        let sets = [("01-random", "random"), ("02-mazes", "mazes")];
        let crowds = [(0, 8), (11, 16), (22, 24), (33, 32), (44, 48), (55, 64)];
        let names = sets.into_iter().flat_map(|(set, maps)| {
            crowds.map(|(map, num_agents)| {
                (format!("{set}|validation-{maps}-seed-{map:03}|{num_agents}"), num_agents)
            })
        });
        let of = |(name, num_agents): (String, usize)| {
            let array = |field: &str| read_array(&path, &format!("{name}|{field}"));
            Self { cells: array("xy"), goals: array("goal"), actions: array("action"), num_agents, name }
        };
        names.map(of).collect()
    }

    /// Starts the same episode.
    fn start(&self) -> Episode<Engine> {
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
    fn actions(&self, step: usize) -> Vec<Action> {
        let numbers = &self.actions[step * self.num_agents..][..self.num_agents];
        numbers.iter().map(|&number| Action::try_from(number as i64).unwrap()).collect()
    }

    /// Returns the cells or goals of a step. The file counts rows and columns from the corner of a border of width 5.
    fn places(&self, places: &[f32], step: usize) -> Vec<Cell> {
        let pairs = places[step * self.num_agents * 2..][..self.num_agents * 2].chunks(2);
        pairs.map(|pair| Cell::new(pair[0] as u16 - 5, pair[1] as u16 - 5)).collect()
    }
}

#[test]
fn recorded_episodes_are_played_action_for_action() {
    let Some(folder) = weights("the recorded episodes of Follower-lite") else { return };
    let learned = LearnedName::Follower.read(&folder.join("follower-lite.onnx")).unwrap();
    let learned = learned.with_sampling(Sampling::Follower).unwrap();
    let mut different = Vec::new();
    for recorded in Recorded::all(&folder) {
        let mut episode = recorded.start();
        let mut policy = learned.begin(episode.instance().unwrap(), episode.config(), 0, 1, None).unwrap();
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
