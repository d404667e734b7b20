"""Tests of the shipped weights: each folder belongs to a method, and its network plays the same in Rust and PyTorch."""

import json
from pathlib import Path

import pytest
from pogema_rs import policies
from pogema_rs.baselines import METHODS
from pogema_rs.baselines._config import read_config
from small import VALUE_METHODS, compare_outputs, compare_play, read_network

WEIGHTS = Path(__file__).resolve().parent.parent.parent / "policies" / "weights"
SHIPPED = sorted(folder.name for folder in WEIGHTS.iterdir() if folder.is_dir())


def test_the_folders_are_methods():
    assert SHIPPED and set(SHIPPED) <= set(METHODS) and set(SHIPPED) <= set(policies.LEARNED)


@pytest.mark.parametrize("method", SHIPPED)
def test_shipped_weights_choose_the_same_actions_in_rust(method):
    run = json.loads((WEIGHTS / method / "run.json").read_text(encoding="utf-8"))
    config = read_config(run["config"], run["method"], "run.json")
    network = read_network(method, config, WEIGHTS / method / "weights.safetensors")
    policy = policies.load(name=method, sampling="greedy")
    masks = json.loads((WEIGHTS / method / "weights.json").read_text(encoding="utf-8"))["sampling"].get(
        "mask_actions", False
    )
    assert policy.encoder == config.encoder
    if method in VALUE_METHODS:
        # The side of an agent depends only on these values.
        compare_outputs(policy, network, config, lanes=2, steps=64)
        return
    assert compare_play(policy, network, config, lanes=4, steps=64, masks=masks) > 1000
