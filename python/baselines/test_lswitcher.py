"""Tests of the trainer of LSwitcher's network."""

import numpy as np
import torch
from pogema_rs import VecEnv, policies
from pogema_rs.baselines._collector import Collector
from pogema_rs.baselines._episodes import Episodes
from pogema_rs.baselines._lswitcher import ValueLearner, _alone
from small import small_config


def learner_of(config):
    return ValueLearner(config, (5, 5), torch.Generator().manual_seed(0))


def record_of(config, learner):
    """Plays one iteration of a learner and returns its record."""
    episodes = Episodes(config.environment, 1, config.schedule.validation_steps)
    configs, seeds = episodes.of_iteration(0, config.schedule.lanes)
    collector = Collector(config, episodes.map_size, config.schedule.lanes, 1)
    record, _ = collector.play(configs, seeds, learner.actor())
    collector.close()
    return record


def test_one_player_alone_plays_as_its_policy():
    config = {"num_agents": 6, "size": 10, "on_target": "restart", "collision_system": "soft"}
    env = VecEnv(config, 2)
    alone, epom, planned = _alone(0, 7), policies.load(name="epom", seed=7), _alone(1, 7)
    env.reset(seed=3)
    # `act` does not change the environment, so all three policies can choose actions in each state.
    others = 0
    for _ in range(32):
        actions = alone.act(env)
        np.testing.assert_array_equal(actions, epom.act(env))
        others += int((actions != planned.act(env)).sum())
        env.step(actions)
    env.close()
    assert others > 20


def test_returns_follow_a_plain_loop():
    changes = ["environment.on_target=[finish]", "environment.max_episode_steps=20", "schedule.lanes=16"]
    config = small_config("lswitcher", *changes)
    learner = learner_of(config)
    record = record_of(config, learner)
    found = learner._returns(record, 1).numpy()
    with torch.no_grad():
        values = learner._values(record, 1).numpy()
    steps, lanes, agents = record.shape
    seen = 0
    for lane in range(lanes):
        last = int(record.played[:, lane].sum()) - 1
        for agent in range(agents):
            later = values[last + 1, lane, agent]
            for step in range(last, -1, -1):
                later = record.rewards[step, lane, agent] + 0.99 * later * ~record.terminated[step, lane, agent]
                assert abs(found[step, lane, agent] - later) < 1e-5
                seen += 1
    assert seen > 50 and record.rewards.any()


def test_policies_take_turns_in_every_kind_of_episode():
    config = small_config("lswitcher", "environment.num_agents=[1, 2]")
    learner, players = learner_of(config), []
    for _ in range(6):
        players.append(learner.player)
        learner.learn(record_of(config, learner))
    assert players == [0, 0, 1, 1, 0, 0]


def test_an_update_changes_only_the_weights_of_its_player_in_the_last_layer():
    config = small_config("lswitcher")
    learner = learner_of(config)
    before = learner.network.policy.weight.detach().clone()
    learner.learn(record_of(config, learner))
    changed = (learner.network.policy.weight != before).any(dim=1)
    assert changed.tolist() == [True, False]


def test_updates_lower_the_loss():
    config = small_config("lswitcher", "environment.on_target=[finish]", "learner.learning_rate=0.01")
    learner = learner_of(config)
    record = record_of(config, learner)
    losses = []
    for _ in range(40):
        learner._iteration = 0
        losses.append(learner.learn(record)["loss"])
    assert losses[-1] < 0.3 * losses[0]
