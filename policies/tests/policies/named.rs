//! Policies by name: unknown names, policies that need weights, and planners in lifelong episodes.

use pogema_core::{Action, Error};
use pogema_numpy::Generator;
use pogema_planners::Budget;
use pogema_policies::{LearnedName, NamedPolicy, PolicySettings};

use crate::common;

fn start(max_steps: u32) -> pogema_core::Episode<pogema_fast::Engine> {
    let yaml = format!(
        "{{size: 16, density: 0.1, num_agents: 8, seed: 1, on_target: restart, collision_system: soft, \
         max_episode_steps: {max_steps}}}"
    );
    common::start(&yaml).unwrap()
}

fn make(name: &str, settings: &PolicySettings, max_steps: u32) -> Result<NamedPolicy, Error> {
    let episode = start(max_steps);
    NamedPolicy::new(name, settings, episode.config(), episode.instance()?, Generator::seeded(0))
}

#[test]
fn an_unknown_name_is_reported_before_settings() {
    let learned = LearnedName::Iql.with_shipped_weights().unwrap();
    let settings = || PolicySettings::default();
    for settings in [
        settings(),
        PolicySettings { single_attempt: true, ..settings() },
        PolicySettings { future_goals: true, ..settings() },
        PolicySettings { learned: Some(learned), ..settings() },
    ] {
        let error = make("lacamm", &settings, 8).err().unwrap().to_string();
        assert!(error.starts_with("`policy` is `lacamm`, expected one of `random`, `astar`"), "{error}");
    }
}

#[test]
fn only_mats_lp_and_network_need_weights() {
    for (name, _) in NamedPolicy::all() {
        let needs_weights = ["mats-lp", "network"].contains(&name);
        assert_eq!(make(name, &PolicySettings::default(), 8).is_err(), needs_weights, "{name}");
    }
}

#[test]
fn a_planner_has_no_step_limit_in_lifelong_episodes() {
    let play = |max_steps: u32| -> Vec<Vec<Action>> {
        let settings = PolicySettings { budget: Budget::of_nodes(100), ..PolicySettings::default() };
        let mut policy = make("lacam", &settings, max_steps).unwrap();
        let mut episode = start(max_steps);
        (0..40)
            .map(|_| {
                let actions = policy.act(&episode).unwrap();
                episode.step(&actions).unwrap();
                actions
            })
            .collect()
    };
    let actions = play(40);
    assert_eq!(actions, play(1000));
    assert!(actions[39].iter().any(|&action| action != Action::Stay), "agents move up to the last step");
}
