//! Runs the examples with their assertions, and tests the episodes and batches that configs create.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "../examples/batch.rs"]
mod batch;
#[path = "../examples/episode.rs"]
mod episode;
#[path = "../examples/own_engine.rs"]
mod own_engine;
#[path = "../examples/own_policy.rs"]
mod own_policy;
#[path = "../examples/plan_and_replay.rs"]
mod plan_and_replay;

use pogema::{Action, Environment, GridConfig, Observations, Seed, StepResults};

#[test]
fn batch_runs() {
    batch::main().unwrap();
}

#[test]
fn episode_runs() {
    episode::main().unwrap();
}

#[test]
fn own_engine_runs() {
    own_engine::main().unwrap();
}

#[test]
fn own_policy_runs() {
    own_policy::main().unwrap();
}

#[test]
fn plan_and_replay_runs() {
    plan_and_replay::main().unwrap();
}

/// The seeds of a batch are those of [`pogema::Seed`], which `VecEnv` uses, too.
#[test]
fn a_batch_plays_the_episodes_of_its_seeds() {
    let config = GridConfig::from_yaml("{size: 8, num_agents: 4, max_episode_steps: 1}").unwrap();
    let mut batch = pogema::batch(&config, 3, 7).unwrap();
    batch.reset().unwrap();
    for episode in 0..3 {
        for env in 0..3 {
            let seed = Some(Seed::Shared(7).of_episode(env, episode));
            let alone = pogema::start(&GridConfig { seed, ..config.clone() }).unwrap();
            assert_eq!(batch.episode(env).unwrap(), Some(episode));
            assert_eq!(batch.lane(env).unwrap().snapshot(), alone.snapshot());
        }
        let mut results = StepResults::new(12);
        batch.step(&[Action::Stay; 12], results.out(), Observations::None).unwrap();
    }
}

#[test]
fn an_episode_without_room_is_drawn_again() {
    let config =
        GridConfig::from_yaml("{size: 8, density: 0.4, num_agents: 16, max_episode_steps: 1}").unwrap();
    let mut batch = pogema::batch(&config, 20, 7).unwrap();
    batch.reset().unwrap();
    let mut num_redrawn = 0;
    for episode in 0..5 {
        for env in 0..20 {
            let alone = |attempt| {
                let seed = Some(Seed::Shared(7).of_attempt(env, episode, attempt));
                pogema::start(&GridConfig { seed, ..config.clone() }).ok()
            };
            let (attempt, alone) = (0..).find_map(|attempt| Some((attempt, alone(attempt)?))).unwrap();
            assert_eq!(batch.lane(env).unwrap().snapshot(), alone.snapshot());
            num_redrawn += usize::from(attempt > 0);
        }
        let mut results = StepResults::new(20 * 16);
        batch.step(&[Action::Stay; 20 * 16], results.out(), Observations::None).unwrap();
    }
    assert!((10..90).contains(&num_redrawn), "{num_redrawn}");
}

#[test]
fn a_map_name_names_a_built_in_map() {
    let config = GridConfig::from_yaml("{map_name: four-rooms, num_agents: 2, seed: 1}").unwrap();
    let map = pogema::named_map("four-rooms").unwrap().map;
    assert_eq!(pogema::start(&config).unwrap().instance().unwrap().map(), &map);
    let mut batch = pogema::batch(&config, 1, 0).unwrap();
    batch.reset().unwrap();
    assert_eq!(batch.lane(0).unwrap().size(), map.sides());
    let config = GridConfig { map_name: Some("for-rooms".into()), ..config };
    let expected = "config: `map_name` is `for-rooms`, expected a known map; did you mean `four-rooms`?";
    assert_eq!(pogema::start(&config).err().unwrap().to_string(), expected);
    assert_eq!(pogema::batch(&config, 1, 0).err().unwrap().to_string(), expected);
}

#[test]
fn invalid_batches_are_rejected_with_the_field() {
    let rejection = |text: &str, num_envs| {
        let config = GridConfig::from_yaml(text).unwrap();
        pogema::batch(&config, num_envs, 0).err().unwrap().to_string()
    };
    assert_eq!(rejection("{}", 0), "`num_envs` is `0`, expected at least 1");
    let expected = "config: `persistent` is `true`, expected false, because a batch keeps no steps";
    assert_eq!(rejection("{persistent: true}", 2), expected);
    let rejection = |config| pogema::batch(&config, 2, 0).err().unwrap().to_string();
    let none = GridConfig { num_agents: 0, ..GridConfig::default() };
    assert_eq!(rejection(none), "config: `num_agents` is `0`, expected at least 1");
    let wide = GridConfig { obs_radius: 1 << 40, ..GridConfig::default() };
    assert_eq!(rejection(wide), "config: `radius` is `1099511627776`, expected 1 to 128");
    let many = GridConfig { num_agents: usize::MAX, ..GridConfig::default() };
    assert!(rejection(many).starts_with("config: `num_agents` is `18446744073709551615`, expected at most "));
}
