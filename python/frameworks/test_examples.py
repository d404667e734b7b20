"""Tests that the training examples run with short settings, log, and pass `mypy --strict`."""

import copy
import importlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
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


def recorded(env, names):
    """Returns a list; each step of the environment appends copies of its rewards, flags and entries of `infos`."""
    steps, step = [], env.step

    def recording(actions):
        result = step(actions)
        _, rewards, terminated, truncated, infos = result
        final = {name: copy.deepcopy(infos[name]) for name in names if name in infos}
        steps.append((rewards.copy(), terminated.copy(), truncated.copy(), final))
        return result

    env.step = recording
    return steps


def test_ppo_adds_the_values_of_the_observations_at_the_time_limit(monkeypatch):
    monkeypatch.syspath_prepend(str(EXAMPLES))
    train_ppo = importlib.import_module("train_ppo")
    monkeypatch.setitem(train_ppo.CONFIG, "max_episode_steps", 10)
    params = train_ppo.Params(num_envs=3, hidden=32)
    trainer = train_ppo.Trainer(params, seed=1)
    steps = recorded(trainer.env, ["final_obs", "final_info"])
    trainer.play()
    num_cut = 0
    for got, (rewards, terminated, truncated, final) in zip(trainer.rollout.rewards, steps):
        expected = rewards - params.step_cost
        for env, agent in np.argwhere(truncated & ~terminated):
            seen = torch.from_numpy(final["final_obs"][env][agent])[None]
            mask = torch.from_numpy(final["final_info"]["action_masks"][env][agent])[None]
            with torch.no_grad():
                expected[env, agent] += params.discount * trainer.policy(seen, mask)[1].item()
            num_cut += 1
        np.testing.assert_allclose(got.view(params.num_envs, -1), expected, rtol=1e-5, atol=1e-6)
    assert num_cut >= 3 * params.num_envs


def test_mappo_adds_the_values_of_the_states_at_the_time_limit(monkeypatch):
    monkeypatch.syspath_prepend(str(EXAMPLES))
    train_mappo = importlib.import_module("train_mappo")
    monkeypatch.setattr(train_mappo, "CONFIG", train_mappo.CONFIG.model_copy(update={"max_episode_steps": 10}))
    monkeypatch.setattr(train_mappo, "NUM_ENVS", 3)
    trainer = train_mappo.Trainer(seed=1)
    steps = recorded(trainer.envs, ["final_state"])
    rollout, _ = trainer.play()
    num_cut = 0
    for got, (rewards, terminated, truncated, final) in zip(rollout["rewards"], steps):
        expected = rewards.copy()
        for env, agent in np.argwhere(truncated & ~terminated):
            state = {name: value[None] for name, value in final["final_state"][env].items()}
            with torch.no_grad():
                expected[env, agent] += train_mappo.DISCOUNT * trainer.value(train_mappo.planes(state))[agent].item()
            num_cut += 1
        np.testing.assert_allclose(got.view(expected.shape), expected, rtol=1e-5, atol=1e-6)
    assert num_cut >= 9


def test_examples_are_typed_strictly(tmp_path):
    files = [str(EXAMPLES / name) for name in SHORT]
    # mypy 1.18 crashes when it writes PyTorch's types to its cache.
    options = ["--config-file", "", "--cache-dir", os.devnull, "--strict"]
    command = [sys.executable, "-B", "-m", "mypy", *options, *files]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
