"""Tests that writing into an environment takes effect or raises an error, attribute by attribute."""

from __future__ import annotations

import copy
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import pogema_rs
from pogema_rs import GridConfig, envs, pogema_v0
from pogema_rs.errors import StateError
from pogema_rs.grid import Grid

MODES = {"finish": envs.Pogema, "nothing": envs.PogemaCoopFinish, "restart": envs.PogemaLifeLong}
WRITE_ERRORS = (AttributeError, StateError, TypeError, ValueError)

# The attributes that a user may set or change, with the reason.
SETTABLE = {
    "grid_config": "the next reset reads it",
    "action_space": "as in POGEMA, only wrappers read it",
    "observation_space": "as in POGEMA, only wrappers read it",
    "random_generators": "the next goals are drawn from it",
    "rnd": "as in POGEMA, nothing draws from it",
    "metadata": "Gymnasium's",
    "is_multiagent": "as in POGEMA, only frameworks read it",
    "render_mode": "Gymnasium's",
    "spec": "Gymnasium's",
    "np_random": "Gymnasium's; as in POGEMA, nothing draws from it",
    "np_random_seed": "Gymnasium's",
    "reward_range": "Gymnasium's",
}


def made(on_target: str) -> Any:
    """Returns an environment after a step."""
    fields = {"size": 6, "num_agents": 3, "density": 0.2, "seed": 4, "on_target": on_target, "persistent": True}
    env = MODES[on_target](GridConfig(**fields))
    env.reset()
    env.step([1, 2, 3])
    return env


def attributes(value: Any) -> Iterator[tuple[str, Any]]:
    """Yields the public attributes of an object, except for methods, `unwrapped` and those in `SETTABLE`."""
    for name in dir(value):
        if not name.startswith("_") and name not in SETTABLE and name != "unwrapped":
            found = getattr(value, name)
            if not callable(found):
                yield name, found


def changes(value: Any) -> Iterator[Callable[[], Any]]:
    """Yields calls that change a container."""
    if isinstance(value, (list, np.ndarray)):
        yield lambda: value.__setitem__(0, value[0])
    if isinstance(value, list):
        yield from (lambda: value.append(None), value.clear)
        yield from changes(value[0])
    if isinstance(value, dict):
        key = next(iter(value))
        yield from (lambda: value.__setitem__(key, value[key]), lambda: value.pop(key))
        yield from changes(value[key])


@pytest.mark.parametrize("on_target", MODES)
@pytest.mark.parametrize("of", ["environment", "grid"])
def test_attribute_cannot_be_set_or_changed(of: str, on_target: str) -> None:
    env = made(on_target)
    owner, seen = (env if of == "environment" else env.grid), []
    for name, value in attributes(owner):
        with pytest.raises(WRITE_ERRORS):
            setattr(owner, name, copy.copy(value))
            pytest.fail(f"`{name}` can be set")
        for change in changes(value):
            with pytest.raises(WRITE_ERRORS):
                change()
                pytest.fail(f"a value in `{name}` can be changed")
        seen.append(name)
    expected = {"environment": {"grid", "was_on_goal", "executed_actions"}, "grid": {"positions_xy", "config"}}
    assert expected[of] <= set(seen)


def test_attributes_that_may_be_set_exist() -> None:
    names = {name for mode in MODES for owner in (made(mode), made(mode).grid) for name in dir(owner)}
    # Releases of Gymnasium differ in their own attributes.
    assert [name for name, why in SETTABLE.items() if not why.startswith("Gymnasium's") and name not in names] == []


@pytest.mark.parametrize("name", ["grid", "semantics"])
def test_error_says_what_to_do_instead(name: str) -> None:
    with pytest.raises(StateError, match=f"^`{name}` of PogemaLifeLong cannot be set; (reset|make)"):
        setattr(made("restart"), name, None)


def test_custom_environment_sets_its_grid() -> None:
    env = envs.PogemaBase(GridConfig(size=4))
    env.grid = Grid(env.grid_config)
    assert env.render(mode="ansi")


@pytest.mark.parametrize(
    ("generators", "text"),
    [
        ([np.random.default_rng(0)], "has 1 generator, expected 3, one for each agent"),
        ([1, 2, 3], r"^`random_generators\[0\]` has type `int`, expected a generator that uses `PCG64`$"),
        ([np.random.Generator(np.random.MT19937(1))] * 3, r"\[0\]` has type `MT19937`, expected"),
        ([np.random.default_rng(0)] * 3, r"\[1\]` is also `random_generators\[0\]`"),
        (3, "has type `int`, expected a list of NumPy generators"),
    ],
)
def test_wrong_generators_stop_the_step(generators: Any, text: str) -> None:
    env, other = made("restart"), made("restart")
    kept = env.random_generators
    env.random_generators = generators
    with pytest.raises((TypeError, ValueError), match=text):
        env.step([1, 1, 1])
    env.random_generators = kept
    assert env.step([1, 1, 1])[1:] == other.step([1, 1, 1])[1:]
    assert env.get_targets_xy() == other.get_targets_xy()


def test_grid_without_border_is_rejected() -> None:
    with pytest.raises(StateError, match="add_artificial_border is False, expected True"):
        Grid(GridConfig(size=4), add_artificial_border=False)


def test_config_of_an_environment_can_be_replaced() -> None:
    env = pogema_v0(GridConfig(size=6, num_agents=2, seed=1))
    env.reset()
    env.grid_config = GridConfig(size=5, num_agents=3, seed=2)
    assert len(env.reset()[0]) == 3 == env.unwrapped.grid_config.num_agents


def test_version_is_our_own() -> None:
    code = "import pogema_rs; pogema_rs.install_as_pogema(); import pogema; print(pogema.__version__)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == pogema_rs.__version__


def test_seed_of_a_reset_is_an_attribute_of_the_grid_as_in_pogema() -> None:
    env = made("finish")
    assert not hasattr(env.grid, "seed")
    env.reset(seed=9)
    assert env.grid.seed == 9 and env.grid_config.seed == 4


def test_lists_given_to_a_config_are_copied() -> None:
    rows = [[0, 1, 0], [0, 0, 0]]
    config = GridConfig(map=rows, seed=1, obs_radius=1)
    env = pogema_v0(config)
    env.reset()
    rows[0][1] = 0
    env.reset()
    assert env.get_obstacles(ignore_borders=True).sum() == 1
    config.map[0][1] = 0
    env.reset()
    assert env.get_obstacles(ignore_borders=True).sum() == 0
