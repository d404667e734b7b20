"""Plays a script on one of the two packages and returns everything that a user sees.

The outcomes consist of plain tuples and strings, so that `==` can compare both sides. This file runs in the
interpreters of both packages and imports neither package.
"""

from __future__ import annotations

import contextlib
import copy
import io
import signal
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

Described = tuple
Outcome = dict[str, Any]

# In seconds of processor time, so that other programs do not matter.
TIME_LIMIT = 2.0
GREEDY = 9

_MOVES = ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1))


class Timeout(BaseException):
    """Signals that a call exceeds its time limit; not an Exception, so that `except Exception` does not catch it."""


def _expire(*_: Any) -> None:
    raise Timeout


@dataclass
class Package:
    """The classes and functions of a package that a script uses."""

    config_class: Any
    make: Any
    grid_class: Any
    registry: Any


def described(value: Any) -> Described:
    """Returns a value with its type, and recursively all values in it with their types."""
    if isinstance(value, np.ndarray):
        flags = (value.flags.c_contiguous, value.flags.writeable)
        return ("array", value.dtype.str, value.shape, flags, value.tobytes())
    if isinstance(value, np.generic):
        # NumPy 1 calls the type `bool_`, and NumPy 2 calls it `bool`, like Python's own type.
        kind = "numpy.bool" if isinstance(value, np.bool_) else type(value).__name__.rstrip("_")
        return (kind, repr(value.item()))
    # A read-only list or dictionary counts as a plain list or dictionary.
    if isinstance(value, dict):
        return ("dict", tuple((described(key), described(item)) for key, item in value.items()))
    if isinstance(value, (list, tuple)):
        return ("list" if isinstance(value, list) else "tuple", tuple(described(item) for item in value))
    if type(value).__name__ == "AgentState":
        return ("AgentState", str(value), tuple(described(item) for item in vars(value).values()))
    if type(value).__name__ == "Box":
        return ("Box", described(value.low), described(value.high), value.dtype.str, value.shape)
    if type(value).__name__ == "Discrete":
        return ("Discrete", described(value.n), described(value.start), value.dtype.str)
    if type(value).__name__ == "Dict":
        return ("Dict", tuple((name, described(space)) for name, space in value.spaces.items()))
    return (type(value).__name__, repr(value))


def greedy(env: Any) -> list[int]:
    """Returns an action for each agent: a move to a free cell that is nearer to its goal, or stay."""
    base = env.unwrapped
    actions, obstacles = [], base.get_obstacles()
    for (row, col), goal in zip(base.get_agents_xy(), base.get_targets_xy()):
        best = (abs(row - goal[0]) + abs(col - goal[1]), 0)
        for action, (down, right) in enumerate(_MOVES):
            if not obstacles[row + down, col + right]:
                best = min(best, (abs(row + down - goal[0]) + abs(col + right - goal[1]), action))
        actions.append(int(best[1]))
    return actions


class Player:
    """An environment, and the calls that a script makes on it."""

    def __init__(self, package: Package) -> None:
        self.package = package
        self.env: Any = None
        self.registered: list[str] = []

    def play(self, script: list[tuple]) -> list[Outcome]:
        """Returns the outcome of each call; stops after a timeout or a failed `make`."""
        outcomes: list[Outcome] = []
        signal.signal(signal.SIGVTALRM, _expire)
        try:
            for call in script:
                outcomes.append(self._outcome(call))
                if "timeout" in outcomes[-1] or (call[0] == "make" and "error" in outcomes[-1]):
                    break
        finally:
            for name in self.registered:
                del self.package.registry.GRID_STR_REGISTRY[name]
        return outcomes

    def _outcome(self, call: tuple) -> Outcome:
        outcome: Outcome = {}
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                signal.setitimer(signal.ITIMER_VIRTUAL, TIME_LIMIT)
                outcome["value"] = getattr(self, f"_{call[0]}")(*call[1:])
            except Timeout:
                outcome["timeout"] = True
            except Exception as error:  # noqa: BLE001 - the errors are what is compared
                outcome["error"] = ([kind.__name__ for kind in type(error).__mro__], str(error))
            finally:
                signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        outcome["warnings"] = [([kind.__name__ for kind in one.category.__mro__], str(one.message)) for one in caught]
        return outcome

    def _register(self, name: str, text: str) -> Described:
        made = self.package.registry.RegisteredGrid(name, text)
        self.registered.append(name)
        return described([made.get_obstacles(), made.get_agents_xy(), made.get_targets_xy()])

    def _grid(self, fields: dict[str, Any]) -> Described:
        grid = self.package.grid_class(self.package.config_class(**copy.deepcopy(fields)))
        return described([grid.get_obstacles(), grid.get_obstacles(True), grid.positions_xy, grid.finishes_xy])

    def _config(self, fields: dict[str, Any]) -> Described:
        return described(self.package.config_class(**copy.deepcopy(fields)).dict())

    def _make(self, fields: dict[str, Any]) -> Described:
        config = self.package.config_class(**copy.deepcopy(fields))
        fields = config.dict()
        self.env = self.package.make(config)
        return described([fields, self.env.action_space, self.env.observation_space, self.env.get_num_agents()])

    def _reset(self, seed: int | None) -> Described:
        return described(self.env.reset() if seed is None else self.env.reset(seed=seed))

    def _step(self, plan: list[Any], form: str) -> Described:
        if any(isinstance(action, int) and action == GREEDY for action in plan):
            moves = greedy(self.env)
            plan = [moves[i] if action == GREEDY and i < len(moves) else action for i, action in enumerate(plan)]
        actions = in_container(plan, form)
        try:
            return (described(self.env.step(actions)), self._has_vanished())
        finally:
            self.left = described(actions)

    def _has_vanished(self) -> bool:
        """Returns whether an active agent has no mark on its cell."""
        grid = self.env.unwrapped.grid
        marks, active = grid.positions, grid.is_active
        return any(active[agent] and not marks[cell] for agent, cell in enumerate(grid.positions_xy))

    def _left(self) -> Described:
        """Returns the caller's actions after the last step."""
        return self.left

    def _sample(self) -> Described:
        drawn = self.env.sample_actions()
        actions = described(drawn)
        return (described(self.env.step(drawn)), self._has_vanished(), actions)

    def _back(self) -> Described:
        return described(self.env.step_back())

    def _elapsed(self, steps: int) -> Described:
        return described(self.env.set_elapsed_steps(steps))

    def _history(self) -> Described:
        kept = self.env.get_history()
        again = self.env.decompress_history(kept)
        # POGEMA returns a NumPy bool if a coordinate is a NumPy number.
        is_same = bool(kept[0][0] == kept[0][-1])
        return described([kept, self.env.get_full_history(), again, is_same])

    def _seed(self, seed: int | None) -> Described:
        self.env.unwrapped.grid_config.seed = seed
        return described(self.env.grid_config.seed)

    def _update(self, fields: dict[str, Any]) -> Described:
        self.env.grid_config.update_config(**copy.deepcopy(fields))
        return described(self.env.grid_config.dict())

    def _replace(self, fields: dict[str, Any]) -> Described:
        config = self.package.config_class(**copy.deepcopy(fields))
        self.env.unwrapped.grid_config = config
        return described(config.dict())

    def _dump(self) -> Described:
        return described(self.env.grid_config.dict())

    def _call(self, path: str, arguments: tuple, keywords: dict[str, Any]) -> Described:
        target = self.env
        for name in path.split("."):
            target = getattr(target, name)
        return described(target(*arguments, **keywords) if callable(target) else target)

    def _render(self) -> Described:
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            result = self.env.render()
        return described([result, out.getvalue()])


def in_container(plan: list[Any], form: str) -> Any:
    """Returns actions in one of the containers that a caller may use."""
    if form in ("int64", "int32", "uint8"):
        return np.array(plan, dtype=form)
    if form == "numbers":
        return [np.int64(action) if type(action) is int else action for action in plan]
    return tuple(plan) if form == "tuple" else list(plan)
