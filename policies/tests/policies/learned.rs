//! Networks as policies, with the small network of the repository and changed copies of it.

use std::fs;
use std::path::{Path, PathBuf};

use pogema_core::{Action, Episode};
use pogema_fast::Engine;
use pogema_policies::{Learned, LearnedName, LearnedPolicy, Sampling};

use crate::common;

/// Returns the file of the small network.
pub fn descent() -> PathBuf {
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

fn begin(learned: &Learned, episode: &Episode<Engine>, seed: u64) -> LearnedPolicy {
    learned.begin(episode.instance().unwrap(), episode.config(), seed, 1, None).unwrap()
}

fn play(learned: &Learned, episode: &mut Episode<Engine>, seed: u64) -> Vec<Vec<Action>> {
    let mut policy = begin(learned, episode, seed);
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
    let learned = LearnedName::Network.read(&descent()).unwrap().with_sampling(Sampling::Greedy).unwrap();
    let mut episode = start(1);
    play(&learned, &mut episode, 0);
    assert_eq!(episode.state().cells, episode.state().goals);
}

#[test]
fn actions_depend_on_the_seed_alone() {
    let learned = LearnedName::Network.read(&descent()).unwrap();
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
        // With weights of 0, all actions have the same probability.
        let learned = filled(0.0, folder.path()).with_masks(is_masked).unwrap();
        let mut episode = start(12);
        let mut policy = begin(&learned, &episode, 0);
        let mut num_blocked = 0;
        while !episode.is_over() {
            let actions = policy.act(episode.state()).unwrap();
            let map = episode.instance().unwrap().map();
            let is_blocked = |(cell, action): (&pogema_core::Cell, &Action)| {
                pogema_core::Cell::checked(cell.toward(*action)).is_none_or(|cell| map.is_obstacle(cell))
            };
            num_blocked +=
                episode.state().cells.iter().zip(&actions).filter(|pair| is_blocked(*pair)).count();
            episode.step(&actions).unwrap();
        }
        num_blocked
    };
    assert_eq!(blocked(true), 0);
    assert!(blocked(false) > 0);
}

#[test]
fn errors_about_infinite_logits_name_agent_and_step() {
    let folder = tempfile::tempdir().unwrap();
    let learned = filled(3e38, folder.path());
    let episode = start(3);
    let mut policy = begin(&learned, &episode, 0);
    let error = policy.act(episode.state()).unwrap_err();
    assert_eq!(error.to_string(), "network: the logits or the value of agent 0 in step 0 are not finite");
}

#[test]
fn a_missing_file_is_named() {
    let error = LearnedName::Follower.read(&descent().with_file_name("none.safetensors")).unwrap_err();
    assert!(error.to_string().contains("none.safetensors: "), "{error}");
}

/// Writes a network with two windows of radius 1 and reads it as the network of MATS-LP. `encoder` is a part of its
/// JSON file.
fn read_for_search(encoder: &str, folder: &Path) -> Result<Learned, String> {
    use safetensors::tensor::{Dtype, TensorView, serialize};

    let data = [vec![0; 5 * 18 * 4], vec![0; 5 * 4]];
    let tensors = [("head.weight", vec![5, 18]), ("head.bias", vec![5])].into_iter().zip(&data);
    let tensors =
        tensors.map(|((name, shape), data)| (name, TensorView::new(Dtype::F32, shape, data).unwrap()));
    let path = folder.join("search.safetensors");
    fs::write(&path, serialize(tensors, None).unwrap()).unwrap();
    let architecture = r#"{"window": [2, 3, 3], "layers": ["flatten"], "actions": "head"}"#;
    let json = format!(r#"{{"version": 1, "architecture": {architecture}{encoder}}}"#);
    fs::write(path.with_extension("json"), json).unwrap();
    LearnedName::MatsLp.read(&path).map_err(|error| error.to_string())
}

#[test]
fn mats_lp_rejects_networks_with_another_encoder() {
    let folder = tempfile::tempdir().unwrap();
    let read = |encoder: &str| read_for_search(encoder, folder.path());
    assert!(read("").is_ok());
    assert!(read(r#", "encoder": {"radius": 1, "channels": ["all_agents", "cost_tracer"]}"#).is_ok());
    for (radius, channels) in
        [(1, "cost_tracer, all_agents"), (1, "obstacles, agents"), (2, "all_agents, cost_tracer")]
    {
        let names = channels.replace(", ", r#"", ""#);
        let error =
            read(&format!(r#", "encoder": {{"radius": {radius}, "channels": ["{names}"]}}"#)).unwrap_err();
        let expected = format!(
            "`encoder of the network` is `{channels} with radius {radius}`, expected all_agents or agents, then cost_tracer, with radius 1"
        );
        assert!(error.contains(&expected), "{error}");
    }
}

#[test]
fn only_a_search_has_expansions() {
    let folder = tempfile::tempdir().unwrap();
    let error = |learned: Result<Learned, pogema_core::Error>| learned.unwrap_err().to_string();
    let network = LearnedName::Network.read(&descent()).unwrap();
    let reason = "the policy has no tree search; only `mats-lp` has";
    assert_eq!(error(network.clone().with_expansions(3)), reason);
    assert_eq!(error(network.with_faithful(true)), reason);
    let search = read_for_search("", folder.path()).unwrap();
    assert_eq!(error(search.clone().with_expansions(0)), "`expansions` is `0`, expected 1 to 100000");
    let no_critic = "`faithful` is `false`, expected true, because the network has no critic";
    assert_eq!(error(search.clone().with_faithful(false)), no_critic);
    let unsampled = "`mats-lp` does not sample actions, so `sampling` is not allowed";
    assert_eq!(error(search.clone().with_sampling(Sampling::Greedy)), unsampled);
    for masks_actions in [true, false] {
        let unmasked = "`mats-lp` never moves into obstacles, so `mask_actions` is not allowed";
        assert_eq!(error(search.clone().with_masks(masks_actions)), unmasked);
    }
}
