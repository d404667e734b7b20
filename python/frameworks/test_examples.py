"""Tests that the training examples run with short settings, log, and pass `mypy --strict`."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest
import torch

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
SHORT = {
    "cleanrl_ppo.py": (["--total-steps", "30000", "--tensorboard", "runs", "--wandb", "offline"], "step    24,576"),
    "jaxmarl_ippo.py": (["--updates", "3"], "update    3"),
    "train_mappo.py": (["--minutes", "0.05"], "agent steps  ISR"),
    "train_ppo.py": (["--minutes", "0.05", "--save", "policy.pt", "--plot", "learning.svg"], "unseen seeds: PPO"),
}
FILES = {
    "cleanrl_ppo.py": ["runs/events*", "wandb/offline-run-*/*.wandb"],
    "train_ppo.py": ["policy.pt", "learning.svg"],
}


@pytest.mark.parametrize("name", SHORT)
def test_example_trains(name, tmp_path):
    arguments, shown = SHORT[name]
    command = [sys.executable, "-B", str(EXAMPLES / name), *arguments]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert shown in run.stdout
    for pattern in FILES.get(name, []):
        assert list(tmp_path.glob(pattern)), pattern


def test_bfloat16_changes_the_outputs_of_the_network_little(monkeypatch):
    monkeypatch.syspath_prepend(str(EXAMPLES))
    train_ppo = importlib.import_module("train_ppo")
    torch.manual_seed(0)
    exact, rounded = train_ppo.Policy(363, 64), train_ppo.Policy(363, 64, bf16=True)
    rounded.load_state_dict(exact.state_dict())
    seen, masks = torch.rand(32, 3, 11, 11).round(), torch.ones(32, 5)
    (distribution, values), (other, others) = exact(seen, masks), rounded(seen, masks)
    assert other.logits.dtype == others.dtype == torch.float32
    for difference in (distribution.logits - other.logits, values - others):
        assert 0 < difference.abs().max() < 0.02


def test_examples_are_typed_strictly(tmp_path):
    files = [str(EXAMPLES / name) for name in SHORT]
    # mypy 1.18 crashes when it writes PyTorch's types to its cache.
    options = ["--config-file", "", "--cache-dir", os.devnull, "--strict"]
    command = [sys.executable, "-B", "-m", "mypy", *options, *files]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
