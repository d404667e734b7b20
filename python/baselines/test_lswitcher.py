"""Tests of the trainer of LSwitcher's network."""

import numpy as np
import pytest
import torch
from pogema_rs import VecEnv, policies
from pogema_rs.baselines import Budget, train
from pogema_rs.baselines._collector import Collector, parts
from pogema_rs.baselines._episodes import Episodes
from pogema_rs.baselines._lswitcher import EPOM, LEAST_STEPS, REPLAN, Crowd, ValueLearner
from small import compare_outputs, read_network, small_config


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


def test_agents_that_draw_nothing_play_as_the_exported_network(tmp_path):
    config = small_config("lswitcher", "environment.size=12", "environment.num_agents=8")
    learner = learner_of(config)
    path = tmp_path / "weights.safetensors"
    policies.export(learner.network, config.encoder, path, name="lswitcher")
    fields = {"num_agents": 8, "size": 12, "on_target": "restart", "collision_system": "soft", "max_episode_steps": 150}
    env = VecEnv(fields, 3, encoder=config.encoder)
    seen, _ = env.reset(seed=3)
    crowd, policy = Crowd(learner.network, 0, 7), policies.load(path, name="lswitcher", seed=7)
    # `act` does not change the environment, so both can choose actions in each state.
    for _ in range(120):
        actions = crowd.choose(env, *parts(seen))
        np.testing.assert_array_equal(actions, policy.act(env))
        seen, *_ = env.step(actions)
    env.close()
    followed = np.stack(crowd.followed)
    assert {EPOM, REPLAN} == set(followed.flat) and (followed[1:] != followed[:-1]).any()


def test_agents_that_draw_keep_a_policy_for_some_steps():
    config = small_config("lswitcher")
    fields = {"num_agents": 20, "size": 12, "on_target": "restart", "max_episode_steps": 120}
    env = VecEnv(fields, 40, encoder=config.encoder)
    seen, _ = env.reset(seed=3)
    crowd = Crowd(learner_of(config).network, 1, 7)
    for _ in range(110):
        seen, *_ = env.step(crowd.choose(env, *parts(seen)))
    env.close()
    followed = np.stack(crowd.followed)
    changes = (followed[1:] != followed[:-1]).any(axis=(1, 2))
    assert np.flatnonzero(changes).tolist() == [LEAST_STEPS, 2 * LEAST_STEPS]
    # Each environment has its own share of agents that follow EPOM.
    shares = (followed[0] == EPOM).mean(axis=1)
    assert shares.min() < 0.2 and shares.max() > 0.8 and 0.3 < shares.mean() < 0.7


def test_returns_follow_a_plain_loop():
    changes = ["environment.on_target=[finish]", "environment.max_episode_steps=20", "schedule.lanes=16"]
    config = small_config("lswitcher", *changes)
    learner = learner_of(config)
    record = record_of(config, learner)
    followed = learner._followed(record)
    found = learner._returns(record, followed).numpy()
    with torch.no_grad():
        of_both = learner.network.policy(learner.network.of_record(record)).numpy()
    values = np.take_along_axis(of_both, followed.numpy()[..., None], -1)[..., 0]
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


def test_values_are_those_of_the_followed_policy():
    config = small_config("lswitcher", "environment.num_agents=[1, 2]")
    learner = learner_of(config)
    record = record_of(config, learner)
    followed = learner._followed(record).numpy()
    played = np.stack(learner._crowd.followed)
    # The first crowd has one agent, and the record room for two.
    assert record.shape[2] == 2 and played.shape[2] == 1
    np.testing.assert_array_equal(followed[: len(played), :, :1], played)
    np.testing.assert_array_equal(followed[-1, :, 0], played[-1, :, 0])


@pytest.mark.parametrize("only", [EPOM, REPLAN])
def test_an_update_changes_only_the_values_of_the_followed_policy_in_the_last_layer(only):
    config = small_config("lswitcher", "learner.drawn=0")
    learner = learner_of(config)
    with torch.no_grad():
        learner.network.policy.bias[only] += 100
    record = record_of(config, learner)
    before = learner.network.policy.weight.detach().clone()
    learner.learn(record)
    changed = (learner.network.policy.weight != before).any(dim=1)
    assert changed.tolist() == [only == EPOM, only == REPLAN]


def test_updates_lower_the_loss():
    config = small_config("lswitcher", "environment.on_target=[finish]", "learner.learning_rate=0.01")
    learner = learner_of(config)
    record = record_of(config, learner)
    losses = []
    for _ in range(40):
        losses.append(learner.learn(record)["loss"])
    assert losses[-1] < 0.3 * losses[0]


def test_the_exported_network_returns_the_same_values_in_rust(tmp_path):
    config = small_config("lswitcher", "network.filters=4", "network.blocks=1")
    train(config, tmp_path, Budget(updates=4))
    path = tmp_path / "weights.safetensors"
    policy = policies.load(path, name="lswitcher")
    assert policy.encoder == config.encoder
    compare_outputs(policy, read_network("lswitcher", config, path), config, lanes=4, steps=12)
