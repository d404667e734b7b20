"""Tests of the weights in the tree: what made them, and that they play the same in Rust and in PyTorch."""

import json
from pathlib import Path

import pytest
import torch
from pogema_rs import policies
from pogema_rs.baselines import METHODS
from pogema_rs.baselines._config import read_config
from pogema_rs.baselines._networks import AgentNetwork
from safetensors.numpy import load_file
from small import WITH_VALUE, compare_play

WEIGHTS = Path(__file__).resolve().parent.parent.parent / "policies" / "weights"
SHIPPED = sorted(folder.name for folder in WEIGHTS.iterdir() if folder.is_dir())


def test_the_folders_are_methods():
    assert SHIPPED and set(SHIPPED) <= set(METHODS) and set(SHIPPED) <= set(policies.LEARNED)


@pytest.mark.parametrize("method", SHIPPED)
def test_shipped_weights_choose_the_same_actions_in_rust(method):
    run = json.loads((WEIGHTS / method / "run.json").read_text(encoding="utf-8"))
    config = read_config(run["config"], method, "run.json")
    network = AgentNetwork(config.encoder, config.network, has_value=method in WITH_VALUE)
    tensors = load_file(WEIGHTS / method / "weights.safetensors")
    network.load_state_dict({name: torch.from_numpy(one) for name, one in tensors.items()})
    policy = policies.load(name=method, sampling="greedy")
    masks = json.loads((WEIGHTS / method / "weights.json").read_text(encoding="utf-8"))["sampling"].get("mask_actions", False)
    assert policy.encoder == config.encoder
    assert compare_play(policy, network, config, lanes=4, steps=64, masks=masks) > 1000
