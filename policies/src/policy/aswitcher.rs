//! ASwitcher: RePlan, and a learned policy for the agents for which RePlan has no move.

use std::time::Duration;

use pogema_core::{Action, Config, Error, Instance, State};

use crate::policy::learned::Player;
use crate::policy::network_player::{NetworkPlayer, NetworkSettings};
use crate::replan::{Plan, ReplanVersion, Replanner};

/// ASwitcher in one episode: RePlan moves the agents, and a network moves those for which RePlan has no move.
///
/// RePlan has no move for an agent that is on its goal, that has no path, or whose path leads back to one of its last
/// two cells.
///
/// Source: when-to-switch, `agents/assistant_switcher.py`
#[derive(Debug)]
pub(crate) struct ASwitcher {
    network: NetworkPlayer,
    planner: Replanner,
}

impl ASwitcher {
    /// Begins an episode. The same seed gives the same actions.
    ///
    /// # Errors
    /// Those of [`NetworkPlayer::begin`].
    pub fn begin(
        settings: &NetworkSettings,
        instance: &Instance,
        config: &Config,
        seed: u64,
    ) -> Result<Self, Error> {
        let network = NetworkPlayer::begin(settings, instance, config, seed)?;
        let sight = settings.encoder.sight;
        Ok(Self { network, planner: Replanner::begin(ReplanVersion::Cpp, instance, config.occupancy, sight) })
    }
}

impl Player for ASwitcher {
    fn network_time(&self) -> Duration {
        self.network.network_time()
    }

    /// The network always acts for all agents, so its memory knows every state.
    fn act(&mut self, state: State<'_>) -> Result<Vec<Action>, Error> {
        let mut actions = self.network.act(state)?;
        for (action, plan) in actions.iter_mut().zip(self.planner.plan(state)) {
            if let Plan::Move(planned) = plan {
                *action = planned;
            }
        }
        Ok(actions)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]

    use std::path::Path;

    use pogema_core::Episode;
    use pogema_fast::Engine;
    use pogema_maps::{GridConfig, InstanceSource};

    use super::*;
    use crate::network::Network;
    use crate::policy::network::NetworkPolicy;

    #[test]
    fn agents_follow_the_plan_and_otherwise_the_network() {
        let config = "{size: 12, density: 0.2, num_agents: 24, seed: 3, collision_system: soft, on_target: restart, \
                      max_episode_steps: 96}";
        let config = GridConfig::from_yaml(config).unwrap();
        let rules = config.rules();
        let instance = InstanceSource::new(config, None).unwrap().generate().unwrap().instance;
        let weights = Path::new(env!("CARGO_MANIFEST_DIR")).join("../suites/policies/descent.safetensors");
        let policy = NetworkPolicy::new(Network::read(&weights).unwrap()).unwrap();
        let settings = policy.settings();
        let mut switcher = ASwitcher::begin(settings, &instance, &rules, 0).unwrap();
        // With the same seed and states, the network alone draws the same actions as in the switcher.
        let mut network = NetworkPlayer::begin(settings, &instance, &rules, 0).unwrap();
        let sight = settings.encoder.sight;
        let mut planner = Replanner::begin(ReplanVersion::Cpp, &instance, rules.occupancy, sight);
        let mut episode = Episode::new(Engine::new(rules).unwrap());
        episode.start(instance).unwrap();
        let (mut num_planned, mut num_learned) = (0, 0);
        while !episode.is_over() {
            let (learned, plans) = (network.act(episode.state()).unwrap(), planner.plan(episode.state()));
            let actions = switcher.act(episode.state()).unwrap();
            for (agent, (plan, learned)) in plans.into_iter().zip(learned).enumerate() {
                let expected = if let Plan::Move(planned) = plan { planned } else { learned };
                assert_eq!(actions[agent], expected, "agent {agent}: {plan:?}, {learned:?}");
                num_planned += usize::from(expected != learned);
                num_learned += usize::from(!matches!(plan, Plan::Move(_)));
            }
            episode.step(&actions).unwrap();
        }
        assert!(num_planned > 100 && num_learned > 100, "{num_planned} and {num_learned} actions");
    }
}
