"""Tests that POGEMA 1.4.0 and pogema_rs behave alike where user code reaches into their classes.

`POGEMA_ORACLE_PYTHON` names the interpreter with POGEMA 1.4.0.
"""

from __future__ import annotations

import copy
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from behaviour import SCENARIOS
from pogema_rs import GridConfig, envs, pogema_v0
from pogema_rs.errors import OverrideError, StateError

SCRIPT = Path(__file__).parent / "behaviour.py"


@pytest.fixture(scope="module")
def results() -> tuple[dict[str, Any], dict[str, Any]]:
    """The results of all scenarios: POGEMA's and ours."""
    sides = ((os.environ["POGEMA_ORACLE_PYTHON"], "pogema"), (sys.executable, "pogema_rs"))
    runs = [
        subprocess.Popen([python, "-B", str(SCRIPT), package], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        for python, package in sides
    ]
    texts = [run.communicate(timeout=300) for run in runs]
    for run, (_, errors) in zip(runs, texts):
        assert run.returncode == 0, errors.decode()
    theirs, ours = (pickle.loads(output) for output, _ in texts)
    return theirs, ours


def is_error(value: Any) -> bool:
    return isinstance(value, tuple) and value[:1] == ("error",)


def difference(theirs: Any, ours: Any, path: str = "") -> str | None:
    """Returns the first difference between two results, or None.

    If POGEMA's result is an error, ours must be an error of the same class or of a subclass.
    """
    if is_error(theirs):
        fits = is_error(ours) and theirs[1][0] in ours[1]
        return None if fits else f"{path}: POGEMA {theirs}, ours {ours}"
    if isinstance(theirs, (list, tuple)) and type(theirs) is type(ours) and len(theirs) == len(ours):
        parts = (difference(*pair, f"{path}[{index}]") for index, pair in enumerate(zip(theirs, ours)))
        return next((part for part in parts if part), None)
    return None if theirs == ours else f"{path}: POGEMA {theirs!r}, ours {ours!r}"


@pytest.mark.parametrize("name", SCENARIOS)
def test_scenario_has_equal_results(name: str, results: tuple[dict[str, Any], dict[str, Any]]) -> None:
    theirs, ours = results
    assert difference(theirs[name], ours[name]) is None


def test_differences_are_found() -> None:
    assert difference([1, ("a", 2)], [1, ("a", 3)]) == "[1][1]: POGEMA 2, ours 3"
    assert difference(("error", ["KeyError"]), ("error", ["MapTextError", "KeyError"])) is None
    assert difference(("error", ["KeyError"]), ("error", ["IndexError"]))
    assert difference([1], (1,)) and difference([1], [1, 2])


NEVER_CALLED = {
    "move_agents": 1,
    "_revert_action": 4,
    "update_was_on_goal": 0,
    "_generate_new_target": 1,
    "_initialize_grid": 0,
}
"""The methods that are never called, with their numbers of arguments."""


@pytest.mark.parametrize("name", NEVER_CALLED)
def test_overridden_method_that_is_never_called_is_an_error(name: str) -> None:
    subclass = type("Own", (envs.PogemaLifeLong,), {name: lambda self, *arguments: None})
    with pytest.raises(OverrideError, match=f"^Own overrides `{name}`, which is never called; "):
        subclass(GridConfig(on_target="restart"))
    with pytest.raises(StateError, match=f"^`{name}` is part of a step"):
        getattr(pogema_v0(GridConfig(on_target="restart")), name)(*[None] * NEVER_CALLED[name])
    with pytest.raises(OverrideError, match=f"^PogemaLifeLong overrides `{name}`, which is never called; "):
        setattr(pogema_v0(GridConfig(on_target="restart")), name, lambda *arguments: None)


def test_methods_of_an_object_or_patched_into_a_class_override_those_of_the_package() -> None:
    def shown(env: Any) -> list[Any]:
        results = [*env.reset(), *env.step([0, 0])]
        return [results[0], results[1], results[2], results[6]]

    env = pogema_v0(GridConfig(num_agents=2, seed=1))
    env._obs = lambda: ["own"] * 2  # type: ignore[method-assign, assignment]
    env._get_infos = lambda: [{"own": True}, {}]  # type: ignore[method-assign]
    assert shown(env) == [["own"] * 2, [{"own": True}, {}]] * 2
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(envs.Pogema, "_obs", lambda self: ["patched"] * 2)
        assert [shown(pogema_v0(GridConfig(num_agents=2, seed=1)))[place] for place in (0, 2)] == [["patched"] * 2] * 2


@pytest.mark.parametrize("name", ["positions_xy", "finishes_xy", "starts_xy", "is_active", "positions", "obstacles"])
def test_grid_cannot_be_written_into(name: str) -> None:
    env = pogema_v0(GridConfig(num_agents=2, seed=1))
    env.reset()
    shown = getattr(env.grid, name)
    before = copy.deepcopy(shown)
    with pytest.raises((StateError, ValueError)):
        shown[0] = 1
    with pytest.raises(AttributeError):
        setattr(env.grid, name, before)
    assert repr(getattr(env.grid, name)) == repr(shown) == repr(before)
    before[0] = before[1]  # a copy can be changed


def test_lists_of_the_state_reject_every_change() -> None:
    env = pogema_v0(GridConfig(num_agents=2, seed=1, on_target="restart"))
    env.reset()
    changes = [("append", 1), ("extend", [1]), ("insert", 0, 1), ("pop",), ("remove", 1), ("clear",), ("sort",)]
    changes += [("reverse",), ("__delitem__", 0), ("__iadd__", [1]), ("__imul__", 2)]
    for shown in (env.grid.positions_xy, env.grid.finishes_xy, env.was_on_goal, env.current_goal_indices):
        for name, *arguments in changes:
            with pytest.raises(StateError, match="reset with agents_xy and targets_xy"):
                getattr(shown, name)(*arguments)
    for name, *arguments in [("update", {}), ("setdefault", 5), ("pop", 0), ("popitem",), ("clear",), ("__ior__", {})]:
        with pytest.raises(StateError):
            getattr(env.grid.is_active, name)(*arguments)
    assert type(pickle.loads(pickle.dumps(env.grid.positions_xy))) is list


def test_actions_of_the_caller_stay_unchanged() -> None:
    """Only `install_as_pogema` makes a step write into the actions of the caller."""
    env = pogema_v0(GridConfig(map="ab\nBA", collision_system="soft"))
    env.reset()
    actions = [4, 3]
    assert env.executed_actions is None
    env.step(actions)
    assert actions == [4, 3]
    assert env.executed_actions == [0, 0]


@pytest.mark.parametrize("system", ["soft", "priority", "block_both"])
def test_executed_actions_are_the_moves(system: str) -> None:
    """Executed actions are 0 for agents that stayed or had finished.

    Copies keep the executed actions, and a step back or a reset clears them.
    """
    config = GridConfig(size=5, num_agents=5, density=0.1, seed=2, collision_system=system, persistent=True)
    env, generator = pogema_v0(config), np.random.default_rng(1)
    moves, seen = np.array(config.MOVES), set()
    env.reset()
    for _ in range(300):
        before, active = np.array(env.get_agents_xy()), env.grid.is_active
        actions = generator.integers(-5, 5, size=5)
        env.step(actions)
        executed = env.executed_actions
        assert (before + moves[executed] == np.array(env.get_agents_xy())).all()
        assert all(move in (0, action % 5) for move, action in zip(executed, actions))
        assert pickle.loads(pickle.dumps(env)).executed_actions == executed
        seen |= {(move == action % 5, active[agent]) for agent, (move, action) in enumerate(zip(executed, actions))}
    assert seen == {(True, True), (False, True), (True, False), (False, False)}
    env.step_back()
    assert env.executed_actions is None
    env.reset()
    assert env.executed_actions is None
