"""Tests the documentation of training: its code runs from the root of the tree, and its networks can be trained."""

from pathlib import Path

import pytest
from page_blocks import blocks, run
from pogema_rs.baselines import Budget, load_config, train

ROOT = Path(__file__).resolve().parent.parent.parent


def test_the_code_of_the_training_page_runs():
    (code,) = [code for framework, code in blocks(ROOT / "docs" / "training.md") if framework == "baselines"]
    run(code, ROOT)


@pytest.mark.parametrize("occupancy", ["as_released", "exact"])
def test_the_networks_of_the_page_on_vanished_agents_can_be_trained(occupancy, tmp_path):
    path = "suites/occupancy/ippo.yaml"
    assert f"train ippo --config {path} " in (ROOT / "docs" / "occupancy_cost.md").read_text(encoding="utf-8")
    small = ["schedule.lanes=2", "schedule.validation_episodes=2", "schedule.validation_steps=4"]
    config = load_config("ippo", ROOT / path, [f"environment.occupancy={occupancy}", *small])
    train(config, tmp_path, Budget(iterations=1))
    assert (tmp_path / "weights.safetensors").exists()
