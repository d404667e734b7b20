"""Tests that wrong input to an environment raises a clear error and does not change its state."""

from __future__ import annotations

import functools
import re
import threading
import warnings
from typing import Any, NamedTuple, get_args

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from pydantic import ValidationError

from pogema_rs import _engine, errors
from pogema_rs.envs import _make_pogema
from pogema_rs.grid_config import GridConfig

CONFIG: dict[str, Any] = {"size": 6, "num_agents": 3, "obs_radius": 2, "density": 0.1, "seed": 3}
SYSTEMS = ("priority", "block_both", "soft")


class Pair(NamedTuple):
    """A cell."""

    row: Any
    col: Any


#: A list that contains itself.
ENDLESS: list = []
ENDLESS.append(ENDLESS)


def started(**fields: Any) -> Any:
    """Returns an environment after its reset."""
    env = _make_pogema(GridConfig(**{**CONFIG, **fields}))
    env.reset()
    return env


def state(env: Any) -> Any:
    """Returns the observable state of an environment."""
    return env.get_agents_xy(), env.get_targets_xy(), env.grid.is_active, env._engine.num_steps


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize(
    ("actions", "classes", "text"),
    [
        ([0, 0], (AssertionError, ValueError), "actions has length 2, expected 3"),
        ([0, 0, 0, 0], (AssertionError, ValueError), "actions has length 4, expected 3"),
        ([], (AssertionError, ValueError), "actions has length 0"),
        ([0, 5, 0], (IndexError, ValueError), "action of agent 1 is `5`"),
        ([4, 4, -6], (IndexError, ValueError), "action of agent 2 is `-6`"),
        ([10**30, 0, 0], (IndexError, ValueError), "action of agent 0"),
        ([1, 1.0, 1], (TypeError,), "action of agent 1 is `1.0`, expected 0 (stay), 1 (up)"),
        ([1, None, 1], (TypeError,), "action of agent 1 is `None`"),
        ([1, "1", 1], (TypeError,), "action of agent 1 is `'1'`"),
        ([1, 1, float("nan")], (TypeError,), "action of agent 2 is `nan`"),
        ([1, 1, [1]], (TypeError,), "action of agent 2 is `[1]`"),
        (np.array([1.0, 2.0, 3.0]), (TypeError,), "action of agent 0 is `"),
        (np.array([[1, 2, 3]] * 3), (TypeError,), "action of agent 0 is `array([1, 2, 3])`"),
        (3, (TypeError,), "actions is `3`, expected a list of 3 actions"),
        (None, (TypeError,), "actions is `None`, expected a list of 3 actions"),
    ],
)
def test_wrong_actions_change_nothing(actions: Any, classes: tuple, text: str, system: str) -> None:
    """Wrong actions are rejected before any agent moves."""
    env, other = started(collision_system=system), started(collision_system=system)
    before = state(env)
    for kind in classes:
        with pytest.raises(kind, match=re.escape(text)):
            env.step(actions)
    assert state(env) == before
    assert np.array_equal(env.step([1, 2, 3])[0], other.step([1, 2, 3])[0])


def test_actions_of_finished_agents_are_ignored() -> None:
    """As in POGEMA, only the number of actions matters."""
    env = _make_pogema(GridConfig(map="aA.\n.bB", obs_radius=1))
    env.reset()
    assert env.step([4, 0])[4][0] == {"is_active": False}
    env.step([99, 0])
    env.step([None, 4])


def test_calls_before_the_reset_are_rejected() -> None:
    """Every call that needs an episode says that the environment was not reset."""
    env = _make_pogema(GridConfig(**CONFIG))
    calls = (env.render, env.get_agents_xy, env.get_obstacles, env.get_state, env.get_targets_xy_relative)
    for call in (lambda: env.step([0, 0, 0]), *calls):
        for kind in (ResetNeeded, AttributeError):
            with pytest.raises(kind, match="not been reset yet"):
                call()
    assert env.was_on_goal is None
    assert env.get_num_agents() == 3


def test_steps_after_the_end_are_played() -> None:
    """The environment does not reset automatically."""
    env = started(max_episode_steps=2)
    ends = [env.step([0, 0, 0])[3][0] for _ in range(5)]
    assert ends == [False, True, True, True, True]


def test_failed_reset_changes_nothing() -> None:
    """The current episode can be continued."""
    env = started()
    before = state(env)
    env.grid_config.update_config(num_agents=30)
    with pytest.raises(OverflowError, match="num_agents"):
        env.reset()
    env.grid_config.update_config(num_agents=3)
    assert state(env) == before
    env.step([0, 0, 0])


def test_history_needs_persistent() -> None:
    """The error of each call names the missing field, and has both classes that POGEMA's users may catch."""
    env = started()
    for name in ("step_back", "get_history", "get_full_history"):
        # As in POGEMA, only persistent environments have these methods.
        assert not hasattr(env, name)
        for kind in (ValueError, AttributeError):
            with pytest.raises(kind, match="persistent=True"):
                getattr(env, name)
    for kind in (ValueError, AttributeError):
        with pytest.raises(kind, match="persistent=True"):
            env.set_elapsed_steps(1)
    env = _make_pogema(GridConfig(**CONFIG, persistent=True))
    for call in (env.step_back, env.get_history):
        with pytest.raises(errors.NotResetError, match="not been reset yet"):
            call()
    env.reset()
    assert env.step_back() is False
    for kind in (AssertionError, ValueError):
        with pytest.raises(kind, match="expected at least 0"):
            env.set_elapsed_steps(-1)


def test_elapsed_steps_can_be_set() -> None:
    """A step back sets the elapsed steps to the number of steps that remain in the history."""
    env = started(persistent=True, max_episode_steps=10)
    env.set_elapsed_steps(8)
    assert [env.step([0, 0, 0])[3][0] for _ in range(2)] == [False, True]
    env.step_back()
    assert env.step([0, 0, 0])[3][0] is False


def test_sequence_that_wraps_around_triggers_a_warning() -> None:
    """Each wrap triggers one warning, which names the agent."""
    goals = [[[0, 1], [0, 0]], [[1, 2], [1, 1], [1, 0]]]
    env = _make_pogema(
        GridConfig(map="...\n...", agents_xy=[[0, 0], [1, 2]], targets_xy=goals, on_target="restart", obs_radius=1)
    )
    env.reset()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in range(2):
            env.step([4, 0])
            env.step([3, 0])
    texts = [str(one.message) for one in caught]
    assert [one.category for one in caught] == [UserWarning] * 2
    assert all("agent 0 has reached all 2 goals" in text for text in texts)
    assert caught[0].filename == __file__


def test_concurrent_threads_get_an_error() -> None:
    """If another thread's call is running, a call raises an error, and the state stays consistent."""
    env = _make_pogema(GridConfig(size=200, num_agents=4000, obs_radius=5, density=0.05, seed=1))
    env.reset()
    errors_raised: list[BaseException] = []
    num_steps = [0, 0, 0]

    def play(thread: int) -> None:
        for _ in range(2000):
            try:
                env.step(np.full(4000, thread + 1))
                num_steps[thread] += 1
            except Exception as error:  # noqa: BLE001 - the class is what is tested
                errors_raised.append(error)
            if errors_raised:
                return

    threads = [threading.Thread(target=play, args=(number,)) for number in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors_raised
    assert {type(error) for error in errors_raised} == {errors.StateError}
    assert all(
        str(error) == "another thread is using this environment, expected one thread at a time"
        for error in errors_raised
    )
    assert all(isinstance(error, RuntimeError) for error in errors_raised)
    assert env._engine.num_steps == sum(num_steps)
    env.step(np.zeros(4000, dtype=int))


def test_calls_during_a_step_are_state_errors() -> None:
    """The calls raise the same error as a second step; `Reads` makes them when the step reads an action."""
    env = started(on_target="restart")
    engine = env._engine
    calls: dict[str, Any] = {
        **{name: getattr(engine, name) for name in ("infos", "observe", "occupied", "obstacles", "foretold_goals")},
        **{name: getattr(engine, name) for name in ("pools", "goal_generators", "history", "pack_film", "draw_svg")},
        **{name: functools.partial(getattr(engine, name), 0) for name in ("cells", "starts", "goals")},
        **{name: getattr(engine, name) for name in ("step_back", "clear_metrics", "measure", "__reduce__")},
        **{
            name: functools.partial(getattr, engine, name)
            for name in dir(engine)
            if not name.startswith("_") and not callable(getattr(engine, name, None)) and name != "elapsed"
        },
    }
    said = {}

    class Reads:
        def __len__(self) -> int:
            return 3

        def __getitem__(self, agent: int) -> int:
            for name, call in calls.items():
                try:
                    call()
                except RuntimeError as error:
                    said[name] = f"{type(error).__name__}: {error}"
            return 0

    env.step(Reads())
    text = "StateError: another thread is using this environment, expected one thread at a time"
    assert said == {name: text for name in calls}
    assert {"active", "executed", "is_filmed", "size"} <= calls.keys()


def test_step_completes_if_its_warning_is_an_error() -> None:
    """The step that triggers a warning is played in any case."""
    fields = {"map": "..", "agents_xy": [[0, 0]], "targets_xy": [[[0, 1], [0, 0]]], "on_target": "restart"}
    env, other = (_make_pogema(GridConfig(**fields, obs_radius=1, max_episode_steps=3)) for _ in range(2))
    for each, action in ((env, "error"), (other, "ignore")):
        each.reset()
        each.step([4])
        with warnings.catch_warnings():
            warnings.simplefilter(action)
            if action == "error":
                with pytest.raises(UserWarning, match="wraps around"):
                    each.step([3])
            else:
                each.step([3])
    assert state(env) == state(other)
    assert env.step([4])[4] == other.step([4])[4] == [{"is_active": True, "metrics": {"avg_throughput": 1.0}}]


def test_python_accepts_the_same_words_as_the_engine():
    for field in ("on_target", "collision_system", "observation_type", "integration"):
        annotation = GridConfig.model_fields[field].annotation
        literal = next((part for part in get_args(annotation) if get_args(part)), annotation)
        assert sorted(get_args(literal)) == sorted(_engine.WORDS[field]), field


@pytest.mark.parametrize(
    ("fields", "place"),
    [
        ({"size": 1}, ("size",)),
        ({"num_agents": 0}, ("num_agents",)),
        ({"agents_xy": "here"}, ("agents_xy",)),
        ({"map": [[0, 0], [0]]}, ()),
    ],
)
def test_validation_error_names_the_field(fields, place):
    with pytest.raises(ValidationError) as raised:
        GridConfig(**fields)
    (error,) = raised.value.errors()
    assert error["loc"] == place
    assert not error["msg"].startswith("config")


def test_number_beyond_64_bits_is_shown_as_a_number():
    with pytest.raises(ValidationError, match="`max_episode_steps` is `1.18"):
        GridConfig(max_episode_steps=2**70)


def test_assigned_fields_may_hold_numpy_values():
    env = started(num_agents=2)
    env.grid_config.seed = np.int64(5)
    env.grid_config.map = np.zeros((4, 5), dtype=np.uint8)
    env.grid_config.agents_xy = np.array([[0, 0], [1, 1]])
    env.grid_config.targets_xy = ((np.int32(2), 2), (3, 3))
    env.reset()
    assert env.get_agents_xy(ignore_borders=True) == [[0, 0], [1, 1]]
    assert env.get_targets_xy(ignore_borders=True) == [[2, 2], [3, 3]]


@pytest.mark.parametrize(
    ("field", "value", "error", "text"),
    [
        ("seed", 10**30, ValueError, "`seed` is `1e[+]30`, expected a whole number from 0"),
        ("density", float("nan"), ValueError, '`density` is `"nan"`, expected a number from 0 to 1'),
        ("map", object(), TypeError, "^`map` holds an object of type `object`, expected numbers, strings or lists"),
        ("agents_xy", [ENDLESS], ValueError, "^`agents_xy` holds lists nested more than"),
    ],
)
def test_reset_with_an_invalid_assigned_field_changes_nothing(field, value, error, text):
    env = started()
    before = state(env)
    setattr(env.grid_config, field, value)
    with pytest.raises(error, match=text):
        env.reset()
    assert state(env) == before


def test_values_of_numpy_and_iterators_are_read_as_pogema_reads_them():
    config = GridConfig(empty_outside=np.False_, persistent=np.True_, agents_xy=[Pair(np.int64(0), np.int32(1))])
    assert (config.empty_outside, config.persistent, config.agents_xy) == (False, True, [(0, 1)])
    assert type(config.agents_xy[0][0]) is int
    rows = [map(int, row) for row in ("010", "000")]
    assert (
        GridConfig(map=rows).map
        == GridConfig(map=[[np.int8(0), 1, 0], [0, 0, np.False_]]).map
        == [[0, 1, 0], [0, 0, 0]]
    )
    assert GridConfig(map=b".#.").map == GridConfig(map=".#.").map
    assert GridConfig(persistent=b"yes").persistent is True


@pytest.mark.parametrize("cell", [7, "1", 0.5, None, [0], np.zeros((2, 2), int)])
def test_the_error_about_a_map_names_the_wrong_cell(cell):
    rows = [[0] * 64 for _ in range(64)]
    rows[40][12] = cell
    with pytest.raises(ValidationError) as rejected:
        GridConfig(map=rows)
    (error,) = rejected.value.errors()
    assert (error["loc"], error["msg"]) == (
        ("map",),
        f"map: line 41, column 13: `{cell!r}` is not 0 (free) or 1 (obstacle)",
    )


@pytest.mark.parametrize(
    "fields",
    [
        {"on_target": object()},
        {"collision_system": {1}},
        {"persistent": np.array([True, False])},
        {"persistent": b"\xff"},
    ],
)
def test_errors_of_rejected_values_name_the_field(fields):
    with pytest.raises(ValueError) as raised:
        GridConfig(**fields)
    assert f"`{next(iter(fields))}` is `" in str(raised.value)


@pytest.mark.parametrize("cell", [(2**31 - 1, 0), (0, -(2**20) - 1)])
def test_far_cells_of_an_a_star_agent_are_rejected(cell: tuple[int, int]) -> None:
    agent, free = _engine.AStarAgent(0), np.zeros((3, 3), np.float32)
    for name, places in (("xy", (cell, (0, 0))), ("target_xy", ((0, 0), cell))):
        with pytest.raises(
            ValueError, match=rf"^{name} is \({cell[0]}, {cell[1]}\), expected coordinates from -1048576"
        ):
            agent.act(*places, free)
    # The search ends at its limit of nodes, without a path.
    assert agent.act((0, 0), (2**20, 0), free) == (0, False)
