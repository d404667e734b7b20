//! Networks as policies, with the small network of the repository and changed copies of it.

use std::fs;
use std::path::{Path, PathBuf};

use pogema_core::{Action, Episode};
use pogema_fast::Engine;
use pogema_policies::{Learned, LearnedName, NetworkPolicy, Sampling};

use crate::common;

fn descent() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../suites/policies/descent.safetensors")
}

/// Reads the network with one number for all its weights and biases.
fn filled(number: f32, folder: &Path) -> Learned {
    let bytes = fs::read(descent()).unwrap();
    let begin = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let (header, data) = bytes.split_at(begin);
    let path = folder.join("filled.safetensors");
    fs::write(&path, [header, &number.to_le_bytes().repeat(data.len() / 4)].concat()).unwrap();
    fs::copy(descent().with_extension("json"), path.with_extension("json")).unwrap();
    LearnedName::Network.read(&path).unwrap()
}

fn start(num_agents: usize) -> Episode<Engine> {
    let yaml = format!(
        "{{size: 12, density: 0.3, num_agents: {num_agents}, seed: 5, on_target: nothing, collision_system: soft, \
         max_episode_steps: 64}}"
    );
    common::start(&yaml).unwrap()
}

fn network(learned: Learned) -> NetworkPolicy {
    let Learned::Network(policy) = learned else { unreachable!("MATS-LP is a search") };
    policy
}

fn play(learned: &NetworkPolicy, episode: &mut Episode<Engine>, seed: u64) -> Vec<Vec<Action>> {
    let mut policy = learned.begin(episode.instance().unwrap(), episode.config(), seed).unwrap();
    let mut all = Vec::new();
    while !episode.is_over() {
        let actions = policy.act(episode.state()).unwrap();
        episode.step(&actions).unwrap();
        all.push(actions);
    }
    all
}

#[test]
fn the_small_network_leads_a_lone_agent_to_its_goal() {
    let learned =
        network(LearnedName::Network.read(&descent()).unwrap().with_sampling(Sampling::Greedy).unwrap());
    let mut episode = start(1);
    play(&learned, &mut episode, 0);
    assert_eq!(episode.state().cells, episode.state().goals);
}

#[test]
fn actions_depend_on_the_seed_alone() {
    let learned = network(LearnedName::Network.read(&descent()).unwrap());
    let first = play(&learned, &mut start(12), 1);
    assert_eq!(first, play(&learned, &mut start(12), 1));
    assert_ne!(first, play(&learned, &mut start(12), 2));
    let threads: Vec<_> = (0..8)
        .map(|_| {
            let learned = learned.clone();
            std::thread::spawn(move || play(&learned, &mut start(12), 1))
        })
        .collect();
    assert!(threads.into_iter().all(|thread| thread.join().unwrap() == first));
}

#[test]
fn masks_forbid_moves_into_obstacles() {
    let folder = tempfile::tempdir().unwrap();
    let blocked = |is_masked| {
        // Weights of 0 choose all actions with the same probability.
        let learned = network(filled(0.0, folder.path()).with_masks(is_masked).unwrap());
        let mut episode = start(12);
        let mut policy = learned.begin(episode.instance().unwrap(), episode.config(), 0).unwrap();
        let mut num_blocked = 0;
        while !episode.is_over() {
            let actions = policy.act(episode.state()).unwrap();
            let map = episode.instance().unwrap().map();
            let leads_out = |(cell, action): (&pogema_core::Cell, &Action)| {
                let (row, col) = cell.toward(*action);
                let cell =
                    u16::try_from(row).and_then(|row| Ok(pogema_core::Cell::new(row, u16::try_from(col)?)));
                cell.map_or(true, |cell| map.is_obstacle(cell))
            };
            num_blocked += episode.state().cells.iter().zip(&actions).filter(|pair| leads_out(*pair)).count();
            episode.step(&actions).unwrap();
        }
        num_blocked
    };
    assert_eq!(blocked(true), 0);
    assert!(blocked(false) > 0);
}

#[test]
fn logits_that_are_not_finite_name_agent_and_step() {
    let folder = tempfile::tempdir().unwrap();
    let learned = network(filled(3e38, folder.path()));
    let episode = start(3);
    let mut policy = learned.begin(episode.instance().unwrap(), episode.config(), 0).unwrap();
    let error = policy.act(episode.state()).unwrap_err();
    assert_eq!(error.to_string(), "network: the logits of agent 0 in step 0 are not finite");
}

#[test]
fn a_network_of_another_shape_is_no_follower() {
    let error = LearnedName::Follower.read(&descent().with_file_name("none.safetensors")).unwrap_err();
    assert!(error.to_string().contains("none"), "{error}");
}
