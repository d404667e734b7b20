"""Short training runs of all methods: their exported networks choose the same actions in Rust as in PyTorch."""

import json

import pytest
from pogema_rs import policies
from pogema_rs.baselines import Budget, train
from small import PPO_METHODS, Q_METHODS, compare_outputs, compare_play, read_network, small_config


@pytest.mark.parametrize("method", [*Q_METHODS, *PPO_METHODS])
def test_an_exported_network_chooses_the_same_actions_in_rust(method, tmp_path):
    config = small_config(method, "environment.size=8", "environment.num_agents=4", "environment.max_episode_steps=32")
    train(config, tmp_path, Budget(iterations=4))
    assert (tmp_path / "weights.safetensors").stat().st_size <= 2**20
    assert policies.load(tmp_path / "weights.safetensors").sampling == "softmax"
    description = json.loads((tmp_path / "weights.json").read_text())
    assert description["sampling"].get("mask_actions", False) == (not method.startswith("follower"))
    network = read_network(method, config, tmp_path / "weights.safetensors")
    policy = policies.load(tmp_path / "weights.safetensors", sampling="greedy", mask_actions=True)
    assert compare_play(policy, network, config, lanes=8, steps=32) > 20


def test_the_exported_network_of_lswitcher_returns_the_same_values_in_rust(tmp_path):
    config = small_config("lswitcher", "network.filters=4", "network.blocks=1")
    train(config, tmp_path, Budget(iterations=4))
    path = tmp_path / "weights.safetensors"
    policy = policies.load(path, name="lswitcher")
    assert policy.encoder == config.encoder
    compare_outputs(policy, read_network("lswitcher", config, path), config, lanes=4, steps=12)
