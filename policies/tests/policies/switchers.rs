//! Tests of RePlan as a policy, and of the switchers, which combine it with a network.

use pogema_core::{Action, Episode, Error};
use pogema_fast::Engine;
use pogema_numpy::Generator;
use pogema_planners::PlannerSettings;
use pogema_policies::{
    Architecture, Channel, EncoderSettings, Layer, Learned, LearnedName, LearnedPolicy, NamedPolicy, Network,
    NetworkConfig, PolicySettings,
};

use crate::common;
use crate::learned::descent;

fn start(num_agents: usize, rules: &str) -> Episode<Engine> {
    let yaml = format!(
        "{{size: 12, density: 0.2, num_agents: {num_agents}, seed: 3, collision_system: soft, max_episode_steps: 96, \
         {rules}}}"
    );
    common::start(&yaml).unwrap()
}

/// Plays an episode with RePlan and returns the actions of all steps.
fn play(episode: &mut Episode<Engine>, seed: u64) -> Vec<Vec<Action>> {
    let planner = PlannerSettings { seed, ..PlannerSettings::default() };
    let settings = PolicySettings { planner, ..PolicySettings::default() };
    let (config, instance) = (*episode.config(), episode.instance().unwrap().clone());
    let mut policy = NamedPolicy::new("replan", &settings, &config, &instance, Generator::seeded(0)).unwrap();
    let mut all = Vec::new();
    while !episode.is_over() {
        let actions = policy.act(episode).unwrap();
        episode.step(&actions).unwrap();
        all.push(actions);
    }
    all
}

fn begin(learned: &Learned, episode: &Episode<Engine>) -> LearnedPolicy {
    learned.begin(episode.instance().unwrap(), episode.config(), 0, 1, None).unwrap()
}

/// Returns LSwitcher with a network that always returns the same outputs.
fn lswitcher(outputs: &[f32]) -> Result<Learned, Error> {
    let architecture = Architecture {
        window: [1, 3, 3],
        scalars: 0,
        layers: vec![Layer::Flatten],
        actions: "values".into(),
        value: None,
    };
    let config = NetworkConfig {
        architecture: Some(architecture),
        encoder: Some(EncoderSettings::new(1, [Channel::Obstacles])),
        ..NetworkConfig::default()
    };
    let len = outputs.len();
    let weight = ("values.weight".to_owned(), vec![len, 9], vec![0.0; 9 * len]);
    let bias = ("values.bias".to_owned(), vec![len], outputs.to_vec());
    LearnedName::LSwitcher.of_network(Network::from_tensors(config, [weight, bias])?)
}

#[test]
fn replan_leads_a_lone_agent_to_its_goal() {
    let mut episode = start(1, "on_target: finish");
    let played = play(&mut episode, 0);
    assert!(played.len() < 96, "the agent did not reach its goal in {} steps", played.len());
}

#[test]
fn replan_leads_many_agents_to_goals_and_depends_on_the_seed() {
    let mut episode = start(24, "on_target: restart");
    let played = play(&mut episode, 0);
    let metrics = episode.metrics();
    assert!(metrics.avg_throughput.unwrap() > 0.5, "{metrics:?}");
    assert_eq!(played, play(&mut start(24, "on_target: restart"), 0));
    assert_ne!(played, play(&mut start(24, "on_target: restart"), 1));
}

#[test]
fn aswitcher_plays_some_actions_of_its_network_and_some_others() {
    let switcher = LearnedName::ASwitcher.read(&descent()).unwrap();
    let network = LearnedName::Network.read(&descent()).unwrap();
    let mut episode = start(24, "on_target: restart");
    let (mut switching, mut learned) = (begin(&switcher, &episode), begin(&network, &episode));
    let (mut same, mut planned) = (0, 0);
    while !episode.is_over() {
        // Both see the same states with the same seed, so the network draws the same actions in both.
        let actions = switching.act(episode.state()).unwrap();
        for (action, other) in actions.iter().zip(learned.act(episode.state()).unwrap()) {
            if *action == other { same += 1 } else { planned += 1 }
        }
        episode.step(&actions).unwrap();
    }
    assert!(same > 100 && planned > 100, "{same} equal and {planned} different actions");
    assert!(switching.network_time() > std::time::Duration::ZERO);
    assert!(episode.metrics().avg_throughput.unwrap() > 0.5);
}

#[test]
fn lswitcher_plays_the_policy_with_the_larger_value() {
    let mut episode = start(24, "on_target: restart");
    let learned = LearnedName::Epom.with_shipped_weights().unwrap();
    let (mut learning, mut epom) =
        (begin(&lswitcher(&[1.0, 0.5]).unwrap(), &episode), begin(&learned, &episode));
    while !episode.is_over() {
        let before = learning.network_time();
        let actions = learning.act(episode.state()).unwrap();
        assert_eq!(actions, epom.act(episode.state()).unwrap());
        assert!(learning.network_time() > before);
        episode.step(&actions).unwrap();
    }

    let planned = play(&mut start(24, "on_target: restart"), 0);
    let mut episode = start(24, "on_target: restart");
    // If the values are equal, LSwitcher plays RePlan.
    let mut planning = begin(&lswitcher(&[0.5, 0.5]).unwrap(), &episode);
    for expected in planned {
        let actions = planning.act(episode.state()).unwrap();
        assert_eq!(actions, expected);
        episode.step(&actions).unwrap();
    }
}

#[test]
fn lswitcher_needs_a_network_with_two_outputs() {
    let error = lswitcher(&[1.0, 0.5, 0.0]).unwrap_err();
    assert_eq!(error.to_string(), "the network has 3 outputs, expected 2: the values of EPOM and of RePlan");
    let error = LearnedName::LSwitcher.read(&descent()).unwrap_err().to_string();
    assert!(
        error.ends_with("the network has 5 outputs, expected 2: the values of EPOM and of RePlan"),
        "{error}"
    );
    assert!(error.contains("descent.safetensors"), "{error}");
}
