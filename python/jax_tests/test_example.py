"""Tests that the example trains, that its saved weights play in Rust, and that it passes `mypy --strict`."""

import subprocess
import sys
from pathlib import Path

import numpy as np
from pogema_rs import VecEnv
from pogema_rs.policies import load

EXAMPLE = Path(__file__).resolve().parent.parent / "examples" / "train_ppo_jax.py"


def test_the_example_trains_and_its_weights_play_in_rust(tmp_path):
    path = tmp_path / "policy.safetensors"
    command = [sys.executable, "-B", str(EXAMPLE), "--iterations", "8", "--instances", "500"]
    run = subprocess.run([*command, "--save", str(path)], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    # Agents that act at random reach 0.36.
    reached = float(run.stdout.splitlines()[-1].rpartition(" ")[2])
    assert reached > 0.5, run.stdout
    config = {"size": 8, "density": 0.3, "num_agents": 4, "on_target": "finish", "max_episode_steps": 64}
    env = VecEnv(config, 128, semantics="2.0", autoreset_mode="Disabled")
    policy, shares = load(path), np.full(128, np.nan)
    env.reset(seed=[10_000 + lane for lane in range(128)])
    while np.isnan(shares).any():
        _, _, _, _, infos = env.step(policy.act(env))
        if "metrics" in infos:
            ended = infos["_metrics"] & np.isnan(shares)
            shares[ended] = infos["metrics"]["ISR"][ended]
    assert abs(shares.mean() - reached) < 0.1


def test_the_example_is_typed_strictly(tmp_path):
    # Outside the source folder, mypy checks against the installed package.
    command = [sys.executable, "-B", "-m", "mypy", "--config-file", "", "--strict", str(EXAMPLE)]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
