"""Tests that an environment pickled or copied in the middle of an episode continues identically."""

from __future__ import annotations

import copy
import functools
import hashlib
import json
import operator
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pogema_rs import AStarAgent, BatchAStarAgent, _engine, pogema_v0
from pogema_rs.envs import _make_pogema
from pogema_rs.grid_config import GridConfig
from pogema_rs.grid_registry import GRID_STR_REGISTRY, RegisteredGrid

SMALL: dict[str, Any] = {"size": 6, "num_agents": 4, "obs_radius": 2, "density": 0.2, "max_episode_steps": 12}
POOLS = {"map": "@.$@\n.$@.\n$..@", "num_agents": 3, "obs_radius": 1, "max_episode_steps": 9}
SEQUENCES = {
    **{"map": "....", "agents_xy": [[0, 0], [0, 3]], "obs_radius": 1, "on_target": "restart"},
    "targets_xy": [[[0, 1], [0, 0]], [[0, 2], [0, 3], [0, 2]]],
}
CONFIGS = {
    "seeded": {**SMALL, "seed": 5},
    "unseeded": SMALL,
    "lifelong": {**SMALL, "on_target": "restart"},
    "lifelong with pools": {**POOLS, "on_target": "restart", "seed": 3},
    "sequences": SEQUENCES,
    "pools": {**POOLS, "seed": 8},
    "one goal": {**SMALL, "on_target": "nothing", "observation_type": "MAPF", "empty_outside": False},
    "persistent": {**SMALL, "on_target": "restart", "persistent": True, "collision_system": "soft"},
    "persistent to the end": {**SMALL, "persistent": True, "seed": 1, "observation_type": "POMAPF"},
    "two cells": {"width": 1, "height": 2, "density": 0.0, "seed": 2, "obs_radius": 1},
}
WAYS = {"deepcopy": copy.deepcopy, "pickle": lambda env: pickle.loads(pickle.dumps(env))}


def plain(value: Any) -> Any:
    """Returns a value in a form that `==` compares completely."""
    if isinstance(value, np.ndarray):
        return (value.dtype.str, value.shape, value.tobytes())
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return (type(value).__name__, [plain(item) for item in value])
    return (type(value).__name__, str(value))


def future(env: Any, plans: np.ndarray) -> list[Any]:
    """Returns everything observable of an environment from now on, except for resets without a seed."""
    seen = []
    for plan in plans:
        seen += [plain(env.step(plan[: env.get_num_agents()])), plain(env.was_on_goal), plain(env.sample_actions())]
        seen += [plain(env.get_targets_xy()), plain(env.get_agents_xy_relative()), plain(env.grid.positions)]
    if env.grid_config.on_target == "restart":
        seen.append(plain(env.get_lifelong_targets_xy()))
    if env.grid_config.persistent:
        for _ in range(3):
            seen += [env.step_back(), plain(env.get_history()), plain(env.get_targets_xy())]
    if env.grid_config.seed is not None:
        seen += [plain(env.reset()), plain(env.step(plans[0][: env.get_num_agents()]))]
    return seen


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
@pytest.mark.parametrize("fields", CONFIGS.values(), ids=CONFIGS)
@pytest.mark.filterwarnings("ignore:agent")
def test_copy_continues_identically(fields: dict[str, Any], way: Any) -> None:
    """A copy made after some steps continues like the original, and neither affects the other."""
    plans = np.random.default_rng(3).integers(5, size=(40, 6))
    env = _make_pogema(GridConfig(**fields))
    env.sample_actions()
    env.reset()
    for plan in plans[:7]:
        env.step(plan[: env.get_num_agents()])
    if fields.get("seed") is not None:
        env.reset()
        env.step(plans[0][: env.get_num_agents()])
    other = way(env)
    assert future(other, plans[7:30]) == future(env, plans[7:30])
    third = way(other)
    assert plain(third.get_agents_xy()) == plain(other.get_agents_xy())


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_copy_made_before_the_reset_plays_the_same_episode(way: Any) -> None:
    """A copy of an environment that has not been reset yet plays the same episode."""
    env = way(_make_pogema(GridConfig(**SMALL, seed=4)))
    other = _make_pogema(GridConfig(**SMALL, seed=4))
    assert plain(env.reset()) == plain(other.reset())


def test_recording_continues_in_a_copy() -> None:
    """The recording of an episode is copied with it."""
    env = _make_pogema(GridConfig(**SMALL, seed=4))
    env._engine.film(True)
    env.reset()
    env.step([1, 2, 3, 4])
    other = copy.deepcopy(env)
    for each in (env, other):
        each.step([4, 3, 2, 1])
    assert other._engine.draw_svg() == env._engine.draw_svg()


def test_copy_keeps_its_registered_map() -> None:
    """A copy needs the registry only at the next reset."""
    RegisteredGrid("pickled", "...#\n....")
    try:
        env = _make_pogema(GridConfig(map_name="pickled", num_agents=2, seed=1, obs_radius=2))
        env.reset()
        other = copy.deepcopy(env)
        assert plain(other.step([1, 2])) == plain(env.step([1, 2]))
        assert plain(other.reset()) == plain(env.reset())
    finally:
        del GRID_STR_REGISTRY["pickled"]


def test_copied_grid_is_read_only() -> None:
    """The arrays of a grid are read-only, also in a copy."""
    env = _make_pogema(GridConfig(**SMALL, seed=4))
    env.reset()
    assert not env.grid.obstacles.flags.writeable
    assert not copy.deepcopy(env).grid.obstacles.flags.writeable


@pytest.mark.parametrize("saved", [b"", b"{}", b"[]", b"nonsense", b"\xff", b"[" * 10000])
def test_foreign_bytes_are_rejected(saved: bytes) -> None:
    """Only bytes saved by an environment are restored."""
    with pytest.raises(ValueError, match="not a saved environment"):
        _engine.restore_engine(saved)


def test_corrupt_bytes_are_rejected() -> None:
    """An inconsistent state raises a ValueError, and no other error."""
    env = _make_pogema(GridConfig(**SMALL, seed=4, on_target="restart"))
    env.reset()
    _, (saved,) = env._engine.__reduce__()
    generator = np.random.default_rng(5)
    num_rejected = 0
    for _ in range(300):
        start = int(generator.integers(len(saved) - 4))
        length = int(generator.integers(1, 4))
        corrupt = (
            saved[:start] + bytes(generator.integers(32, 127, size=length, dtype=np.uint8)) + saved[start + length :]
        )
        try:
            engine = _engine.restore_engine(corrupt)
            engine.step([0, 1, 2, 3])
        except ValueError as error:
            num_rejected += 1
            assert "\n" not in str(error)
    assert num_rejected > 200
    wrong = saved.replace(b'"version":1', b'"version":2')
    with pytest.raises(ValueError, match="version 1"):
        _engine.restore_engine(wrong)


@pytest.mark.parametrize("place", [("elapsed",), ("meter", "step"), ("meter", "num_reached"), ("episode", "step")])
def test_impossible_counts_are_rejected(place: tuple[str, ...]) -> None:
    """A saved environment whose next step would overflow a counter raises a ValueError."""
    env = _make_pogema(GridConfig(**SMALL, seed=4))
    env.reset()
    state = json.loads(env._engine.__reduce__()[1][0])
    holder = functools.reduce(operator.getitem, place[:-1], state)
    holder[place[-1]] = 2**64 - 1
    with pytest.raises(ValueError, match="a count is larger than"):
        _engine.restore_engine(json.dumps(state).encode())


#: Environments that the first release saved after 7 steps, with the digest of the next 14 steps of each.
SAVED = {
    "restart-soft": "a0c1738a7284cc0024874198f582abeeddb29383763934dfe529854aabf215ec",
    "finish-priority": "6c1cad9be923b0f7944ac600f28e4e2f3dc6d946fa5f1bb6c5f565413204ddfc",
    "nothing-block_both": "eebe5071a53a7401874b6f22a3ebdaa5ab475137487794d6cb05711b54196dd6",
}


@pytest.mark.parametrize("name", SAVED)
def test_environment_saved_by_the_first_release_continues(name: str) -> None:
    """An environment that the first release saved plays the same steps as it did then."""
    env = pickle.loads((Path(__file__).parent / "saved" / f"{name}.pickle").read_bytes())
    rng = np.random.default_rng(1)
    rng.integers(5, size=(7, 10))
    digest = hashlib.sha256()
    for actions in rng.integers(5, size=(14, 10)):
        observations, *rest = env.step(actions.tolist())
        digest.update(np.array(observations).tobytes())
        rewards, terminated, truncated, infos = rest
        digest.update(repr(([*map(float, rewards)], [*terminated], [*truncated], repr(infos))).encode())
    assert digest.hexdigest() == SAVED[name]


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))])
def test_copied_agents_continue_identically(copied):
    config = GridConfig(
        num_agents=20, size=8, density=0.2, seed=3, on_target="restart", observation_type="POMAPF", max_episode_steps=60
    )
    env = pogema_v0(config)
    observations, _ = env.reset()
    team = BatchAStarAgent()
    for _ in range(15):
        observations, *_ = env.step(team.act(observations))
    other, alone = copied(team), copied(AStarAgent(seed=5))
    num_random = 0
    for _ in range(15):
        actions = team.act(observations)
        assert actions == other.act(observations)
        num_random += sum(isinstance(action, np.int64) for action in actions)
        observations, *_ = env.step(actions)
    assert num_random > 0, "no agent acted at random"
    first = pogema_v0(config).reset()[0][0]
    fresh = AStarAgent(seed=5)
    assert [alone.act(first) for _ in range(9)] == [fresh.act(first) for _ in range(9)]


@pytest.mark.parametrize("saved", [b"", b"{}", b"[1, [], null]", b"\xff" * 40])
def test_bytes_that_are_not_a_saved_agent_are_rejected(saved):
    with pytest.raises(ValueError, match="saved A\\* agent"):
        _engine.restore_astar(saved)


def test_a_saved_agent_far_away_is_rejected():
    restore, (saved,) = _engine.AStarAgent(0).__reduce__()
    wrong = json.loads(saved)
    for cells, last in ([[2**30, 0]], None), ([], [0, -(2**31)]):
        with pytest.raises(ValueError, match="a cell is too far away"):
            restore(json.dumps([wrong[0], cells, last]).encode())
