"""Tests the type hints of the package and of its compiled part, and their use by a caller's type checker."""

import subprocess
import sys
from pathlib import Path

import pytest

import pogema_rs
from example_files import EXAMPLES, WITH_FRAMEWORK

CONFIG = Path(__file__).resolve().parent.parent / "pyproject.toml"

RIGHT = """
from collections.abc import Sequence
from typing import Any, assert_type

import numpy as np

from pogema_rs import AnimationConfig, AStarAgent, GridConfig, Semantics, VecEnv, Wrapper, pogema_v0
from pogema_rs.envs import Pogema
from pogema_rs.policies import Encoder, load


class FewerRewards(Wrapper[dict[str, Any]]):
    def agents(self) -> int:
        return self.unwrapped.get_num_agents()


config = GridConfig(num_agents=4, size=8, seed=1, observation_type="POMAPF")
env: Pogema[dict[str, Any]] = pogema_v0(config, semantics=Semantics.DEVELOPED)
observations, infos = env.reset(seed=1)
observations, rewards, terminated, truncated, infos = env.step(env.sample_actions())

assert_type(infos, list[dict[str, Any]])
assert_type(rewards, list[float])
assert_type(truncated, list[bool])

arrays = pogema_v0(GridConfig())
assert_type(arrays, Pogema[np.ndarray])
assert_type(arrays.reset()[0], list[np.ndarray])
assert_type(arrays.unwrapped.get_state(), np.ndarray)
assert_type(arrays.get_state(as_dict=True), dict[str, Any])
assert_type(FewerRewards(env).step([0])[0], list[dict[str, Any]])

own: Pogema[dict[str, Any]] = Pogema(config, semantics="2.0")
first, _ = own.reset()
alone: list[dict[str, Any]] = own.reset(return_info=False)
flags: list[bool] = own.step([0, 0, 0, 0])[2]
places: list[Sequence[int]] = own.get_agents_xy(only_active=True)
action = int(AStarAgent(seed=1).act(first[0]))
count: int = FewerRewards(own).agents()
own.save_animation("episode.svg", AnimationConfig(egocentric_idx=0))

envs = VecEnv([config, {"num_agents": 4}], num_threads=2, dtype="uint8", autoreset_mode="next_step", masks=True)
buffer: np.ndarray = np.zeros(envs.observation_space.shape, dtype=np.uint8)
batch, about = envs.reset(seed=[1, 2], out=buffer)
batch, sums, ended, cut, about = envs.step(envs.sample_actions())
solved = float(about["metrics"]["ISR"][0]) + float(sums.sum())

seen: VecEnv[np.ndarray] = VecEnv(config, 2, encoder=Encoder(5, ["cost_to_go"], scalars=["goal_offset"]))
policy = load("weights.safetensors", sampling="greedy")
assert_type(policy.act(seen), np.ndarray)
assert_type(policy.act(env.reset()[0]), list[int])
"""

WRONG = {
    "config.num_agent": "attr-defined",
    'config.width = "eight"': "assignment",
    "pogema_v0(3)": "arg-type",
    "pogema_v0(config, semantics=2.0)": "arg-type",
    "Semantics.LATEST": "attr-defined",
    "own.step(1)": "arg-type",
    'own.reset(seed="one")': "call-overload",
    "own.get_agents_xy(active=True)": "call-arg",
    'FewerRewards(own).agents() + "agents"': "operator",
    'VecEnv(config, num_envs="many")': "arg-type",
    "VecEnv(config, threads=2)": "call-arg",
    'envs.step(envs.sample_actions(), out="here")': "arg-type",
    "envs.num_agents.size": "attr-defined",
    "AnimationConfig(static=None)": "arg-type",
    'Encoder(5, channels=["goal"], scalar=[])': "call-arg",
    'load("weights.safetensors", seed="one")': "arg-type",
    "policy.act(3)": "call-overload",
}


# The options of a caller's type checker. Runs with the same options share a cache of what mypy found in the
# dependencies.
STRICT = ("--config-file", "", "--strict", "--warn-unreachable")


@pytest.fixture(scope="module")
def check(tmp_path_factory):
    """Runs a type checker outside the source folder, so that it checks the installed package."""
    folder = tmp_path_factory.mktemp("types")

    def run(module, *arguments):
        command = [sys.executable, "-B", "-m", module, *arguments]
        return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)

    return run


def lines_with_errors(text):
    """Returns the error codes of each line of a program."""
    found = {}
    for line in text.splitlines():
        place, _, what = line.partition(": error: ")
        if what:
            found.setdefault(int(place.rpartition(":")[2]), set()).add(what.rpartition("[")[2].rstrip("]"))
    return found


def test_wheel_contains_type_hints():
    folder = Path(pogema_rs.__file__).parent
    assert (folder / "py.typed").is_file() and (folder / "_engine.pyi").is_file()


def test_package_type_checks(check):
    run = check("mypy", "--config-file", str(CONFIG), "-p", "pogema_rs")
    assert run.returncode == 0, run.stdout + run.stderr


@pytest.mark.slow
def test_stub_matches_the_compiled_part(check):
    run = check("mypy.stubtest", "--mypy-config-file", str(CONFIG), "pogema_rs._engine")
    assert run.returncode == 0, run.stdout + run.stderr


@pytest.mark.slow
def test_type_errors_of_a_program_are_found(check, tmp_path):
    program = tmp_path / "program.py"
    program.write_text(RIGHT + "\n".join(WRONG) + "\n")
    run = check("mypy", *STRICT, str(program))
    assert run.returncode == 1, run.stdout + run.stderr
    first = RIGHT.count("\n") + 1
    assert lines_with_errors(run.stdout) == {first + place: {code} for place, code in enumerate(WRONG.values())}, (
        run.stdout
    )


# `./check frameworks` and `./check jax` check the types of the examples with a framework.
@pytest.mark.slow
def test_examples_are_typed_strictly(check):
    files = sorted(EXAMPLES.glob("*.py"))
    assert {path.name for path in files} > WITH_FRAMEWORK
    plain = [str(path) for path in files if path.name not in WITH_FRAMEWORK]
    run = check("mypy", *STRICT, *plain)
    assert run.returncode == 0, run.stdout + run.stderr
