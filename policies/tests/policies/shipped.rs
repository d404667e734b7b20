//! The weights that the crate contains, played without a file.

use std::fs;
use std::path::Path;

use pogema_core::{OnGoal, Words};
use pogema_policies::LearnedName;

use crate::common;

/// Returns the policies with weights in the crate.
fn shipped() -> impl Iterator<Item = LearnedName> {
    let all = LearnedName::NAMES.iter().map(|name| LearnedName::of_word(name).unwrap());
    all.filter(|name| name.shipped_weights().is_some())
}

#[test]
fn shipped_weights_lead_most_agents_to_their_goals() {
    assert!(shipped().count() >= 8);
    let all = shipped().flat_map(|name| [(name, "nothing"), (name, "restart")]);
    // EPOM, `follower-large` and `follower-small` were trained on lifelong episodes only, so their agents often leave
    // their goals. In the switchers, EPOM moves some agents off their goals, too.
    let leaves = |name| {
        use LearnedName::{ASwitcher, Epom, FollowerLarge, FollowerSmall, LSwitcher};
        matches!(name, ASwitcher | Epom | FollowerLarge | FollowerSmall | LSwitcher)
    };
    for (name, on_target) in all.filter(|&(name, on_target)| on_target == "restart" || !leaves(name)) {
        let learned = name.with_shipped_weights().unwrap();
        let yaml = format!(
            "{{size: 16, density: 0.2, num_agents: 8, seed: 3, on_target: {on_target}, collision_system: soft, \
             max_episode_steps: 128}}"
        );
        let mut episode = common::start(&yaml).unwrap();
        let mut policy = learned.begin(episode.instance().unwrap(), episode.config(), 0, 1, None).unwrap();
        let (mut num_reached, mut num_on_goals) = (0, 0);
        while !episode.is_over() {
            let before = episode.state().goals.to_vec();
            let actions = policy.act(episode.state()).unwrap();
            episode.step(&actions).unwrap();
            let state = episode.state();
            num_reached += before.iter().zip(state.cells).filter(|(goal, cell)| goal == cell).count();
            num_on_goals = state.cells.iter().zip(state.goals).filter(|(cell, goal)| cell == goal).count();
        }
        match episode.config().on_goal {
            OnGoal::Restart => assert!(num_reached >= 32, "{}: {num_reached}", name.word()),
            _ => assert!(num_on_goals >= 5, "{}: {num_on_goals}", name.word()),
        }
    }
}

#[test]
fn shipped_weights_tell_how_they_were_trained() {
    // ASwitcher plays EPOM's network.
    for name in shipped().filter(|&name| name != LearnedName::ASwitcher) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("weights").join(name.word());
        let run: serde_json::Value =
            serde_json::from_slice(&fs::read(folder.join("run.json")).unwrap()).unwrap();
        // When the larger Follower was trained, its config was that of `follower`.
        let method = if name == LearnedName::FollowerLarge { LearnedName::Follower } else { name };
        assert_eq!(run["method"], method.word());
        assert!(run["minutes"].as_f64().unwrap() > 1.0 && run["seed"].is_u64() && run["config"].is_object());
        assert_eq!(run["commit"].as_str().unwrap().len(), 40);
        let shipped = name.shipped_weights().unwrap();
        assert!(shipped.tensors.len() <= 1 << 20, "{} bytes", shipped.tensors.len());
        assert_eq!(shipped.tensors, fs::read(folder.join("weights.safetensors")).unwrap());
        let curve = fs::read_to_string(folder.join("curve.csv")).unwrap();
        assert!(curve.lines().count() > 2 && folder.join("curve.svg").exists());
    }
}

#[test]
fn policies_without_weights_need_a_file() {
    for name in ["mats-lp", "network"] {
        let error = LearnedName::of_word(name).unwrap().with_shipped_weights().unwrap_err();
        assert_eq!(error.to_string(), format!("`{name}` needs the weights of a network"));
    }
}
