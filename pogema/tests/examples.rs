//! Runs the examples with their assertions.

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

/// `pogema::batch` draws the same instances as `VecEnv` in Python with the same seed.
#[test]
fn a_batch_plays_the_episodes_of_its_seeds() {
    let config = pogema::GridConfig::from_yaml("{size: 8, num_agents: 4}").unwrap();
    let mut batch = pogema::batch(&config, 3, 7).unwrap();
    batch.reset().unwrap();
    for env in 0..3 {
        let seed = Some(pogema::Seed::Shared(7).of_episode(env, 0));
        let alone = pogema::start(&pogema::GridConfig { seed, ..config.clone() }).unwrap();
        assert_eq!(batch.lane(env).unwrap().cells(), alone.state().cells);
    }
}

#[test]
fn invalid_batches_are_rejected_with_the_field() {
    let refusal = |text: &str, num_envs| {
        let config = pogema::GridConfig::from_yaml(text).unwrap();
        pogema::batch(&config, num_envs, 0).err().unwrap().to_string()
    };
    assert_eq!(refusal("{}", 0), "`num_envs` is `0`, expected at least 1");
    let expected = "config: `persistent` is `true`, expected false, because a batch keeps no steps";
    assert_eq!(refusal("{persistent: true}", 2), expected);
}
