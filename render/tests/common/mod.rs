//! Episodes for tests.

use pogema_core::{Episode, Trace};
use pogema_maps::{GridConfig, InstanceSource};
use pogema_numpy::Generator;
use pogema_planners::{PomapfObservations, pogema_team, sample};
use pogema_reference::Reference;

/// The policy of the agents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    AStar,
    Random,
}

/// Parses a config in YAML.
pub fn config(text: &str) -> GridConfig {
    GridConfig::from_yaml(text).unwrap()
}

/// Plays an episode of a config to its end.
pub fn trace(config: &GridConfig, policy: Policy) -> Trace {
    let instance = InstanceSource::new(config.clone(), None).unwrap().generate().unwrap().instance;
    let mut episode = Episode::new(Reference::new(config.rules()).unwrap()).with_recording();
    episode.start(instance).unwrap();
    let (mut team, mut generator) = (pogema_team(), Generator::seeded(1));
    while !episode.is_over() {
        let actions = match policy {
            Policy::AStar => team.act(PomapfObservations::of(&episode).unwrap().each()).unwrap(),
            Policy::Random => sample(&mut generator, config.num_agents),
        };
        episode.step(&actions).unwrap();
    }
    episode.trace().unwrap()
}
