//! Instances saved and restored during an episode give the same goals as uninterrupted ones.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{Error, GoalStream, Instance, StreamState};
use pogema_maps::{GridConfig, InstanceSource, SavedInstance};

const CONFIGS: [&str; 5] = [
    "{size: 6, num_agents: 4, on_target: restart, seed: 3, density: 0.1}",
    "{size: 6, num_agents: 4, on_target: restart, density: 0.1, empty_outside: false}",
    "{map: '@.$@.$..@', num_agents: 2, obs_radius: 1, on_target: restart, seed: 1}",
    "{map: '...', agents_xy: [[0, 0]], targets_xy: [[[0, 1], [0, 2]]], on_target: restart}",
    "{map: 'a.A'}",
];

fn source(config: &str) -> InstanceSource {
    InstanceSource::new(GridConfig::from_yaml(config).unwrap(), None).unwrap()
}

/// Serializes and deserializes the parts of an instance.
fn saved(instance: &Instance) -> SavedInstance {
    let text = serde_json::to_string(&SavedInstance::of(instance).unwrap()).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn saved_instances_are_restored() {
    for config in CONFIGS {
        let mut source = source(config);
        let instance = source.generate().unwrap().instance;
        let again = source.restore(saved(&instance)).unwrap();
        assert_eq!((again.map(), again.outside()), (instance.map(), instance.outside()));
        assert_eq!(again.starts(), instance.starts());
        for (one, other) in again.goals().iter().zip(instance.goals()) {
            assert_eq!(one.list(30), other.list(30), "{config}");
        }
    }
}

#[test]
fn restored_streams_continue() {
    for config in CONFIGS {
        let instance = source(config).generate().unwrap().instance;
        for stream in instance.goals() {
            let (mut moved, mut again) = (stream.clone(), stream.clone());
            let mut at = stream.first();
            for _ in 0..5 {
                at = moved.advance(at);
            }
            again.restore(&moved.save().unwrap()).unwrap();
            for _ in 0..20 {
                let next = moved.advance(at);
                assert_eq!(again.advance(at), next, "{config}");
                assert_eq!(again.sequence_position(), moved.sequence_position());
                at = next;
            }
        }
    }
}

#[test]
fn states_of_another_kind_are_rejected() {
    let drawn = source(CONFIGS[0]).generate().unwrap().instance;
    let round = source(CONFIGS[3]).generate().unwrap().instance;
    let single = source(CONFIGS[4]).generate().unwrap().instance;
    let streams = [drawn, round, single].map(|instance| instance.goals()[0].clone());
    let mut states: Vec<StreamState> = streams.iter().map(|stream| stream.save().unwrap()).collect();
    states.extend([StreamState::Sequence(2), StreamState::Drawn("{}".into())]);
    for (index, stream) in streams.iter().enumerate() {
        for (other, state) in states.iter().enumerate() {
            let restored = GoalStream::restore(&mut stream.clone(), state);
            assert_eq!(restored.is_ok(), index == other);
            assert!(matches!(restored, Ok(()) | Err(Error::ForeignGoals)));
        }
    }
}
