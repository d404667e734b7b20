"""The states of agents at the steps of an episode."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from types import MethodType
from typing import TYPE_CHECKING, Any, Optional, TypeVar, Union, cast

import numpy as np

from pogema_rs import _engine
from pogema_rs.errors import ElapsedStepsError, NoHistoryError, NotKeptError

if TYPE_CHECKING:
    from pogema_rs.grid import Grid
    from pogema_rs.grid_config import GridConfig
    from pogema_rs.semantics import Semantics

# The largest number that the engine accepts (64 bits). No episode has that many steps.
_LARGEST = 2**64 - 1
# A goal drawn since the reset consists of NumPy integers, as in POGEMA.
_Whole = Union[int, np.int64]


class AgentState:
    """The cell, goal and activity of an agent since a step. Cells are (row, col) on the map with its border.

    Two states are equal if they differ at most in their steps.

    Rule: history/changes
    """

    def __init__(self, x: int, y: int, tx: _Whole, ty: _Whole, step: int, active: bool) -> None:
        self.x = x
        self.y = y
        self.tx = tx
        self.ty = ty
        self.step = step
        self.active = active

    def get_xy(self) -> tuple[int, int]:
        """Returns the cell of the agent."""
        return self.x, self.y

    def get_target_xy(self) -> tuple[_Whole, _Whole]:
        """Returns the goal of the agent."""
        return self.tx, self.ty

    def is_active(self) -> bool:
        """Returns whether the agent is active."""
        return self.active

    def get_step(self) -> int:
        """Returns the step at which this state began, counted from 0 at the reset."""
        return self.step

    def _key(self) -> tuple:
        return self.x, self.y, self.tx, self.ty, self.active

    def __eq__(self, other: object) -> bool:
        return self._key() == other._key() if isinstance(other, AgentState) else NotImplemented

    __hash__ = None  # type: ignore[assignment]

    def __str__(self) -> str:
        numbers = [str(number) for number in (self.x, self.y, self.tx, self.ty, self.step)]
        return f"[{', '.join(numbers)}, {self.active}]"

    def __repr__(self) -> str:
        return f"AgentState{self}"


History = list[list[AgentState]]


def kept(engine: _engine.Engine, shift: int) -> History:
    """Returns for each agent its first state and each later state that differs from the one before."""
    return [[_state(shift, *change) for change in changes] for changes in engine.history()]


def _state(shift: int, row: int, col: int, goal_row: int, goal_col: int, *rest: Any) -> AgentState:
    step, active, is_drawn = rest
    goal: tuple[_Whole, _Whole] = (goal_row + shift, goal_col + shift)
    if is_drawn:
        goal = (np.int64(goal[0]), np.int64(goal[1]))
    return AgentState(row + shift, col + shift, *goal, step, active)


def at_every_step(agent_states: Iterable[AgentState], num_steps: int) -> list[AgentState]:
    """Returns the state of one agent at each step from 0 to `num_steps`, both included."""
    first, *rest = agent_states
    states = [first]
    for step in range(1, num_steps + 1):
        if rest and rest[0].step == step:
            states.append(rest.pop(0))
        else:
            states.append(states[-1])
    return states


def decompressed(history: History) -> History:
    """Returns the state of each agent at each step, up to the last step with a change.

    Rule: history/changes
    """
    num_steps = last_change(history)
    return [at_every_step(changes, num_steps) for changes in history]


def last_change(history: History) -> int:
    """Returns the last step that changed the state of an agent."""
    return max(changes[-1].step for changes in history)


def check_elapsed_steps(env: Kept, is_persistent: object, elapsed_steps: int) -> None:
    """Raises an error if the number of elapsed steps cannot be set to `elapsed_steps`."""
    if env.semantics.elapsed_needs_persistent and not is_persistent:
        raise NotKeptError("elapsed steps can be set only with persistent=True in the config")
    if elapsed_steps < 0:
        raise ElapsedStepsError(f"elapsed_steps is {elapsed_steps}, expected at least 0")


_Method = TypeVar("_Method", bound=Callable[..., Any])


class _Persistent:
    """A method that only environments with a persistent config have, as in POGEMA; for others, `hasattr` is False."""

    def __init__(self, method: Callable[..., Any]) -> None:
        self.method = method

    def __get__(self, env: Optional[Kept], owner: type) -> Callable[..., Any]:
        if env is None:
            return self.method
        if not env._fixed["persistent"]:
            raise NotKeptError("steps are kept only with persistent=True in the config")
        return MethodType(self.method, env)


def _only_persistent(method: _Method) -> _Method:
    return cast(_Method, _Persistent(method))


class Kept:
    """Methods to read and undo the steps of an environment whose config is persistent."""

    grid_config: GridConfig
    grid: Optional[Grid]
    semantics: Semantics
    _engine: _engine.Engine
    _fixed: dict[str, Any]

    @_only_persistent
    def step_back(self) -> bool:
        """Undoes the last step and returns whether there was one; needs `persistent` in the config.

        Rule: history/step-back
        """
        self._check_started()
        moved = self._engine.step_back()
        if self.grid is not None:
            self.grid._forget()
        return moved

    def _check_started(self) -> None:
        if self.grid is None:
            raise NoHistoryError("the environment has not been reset yet; call `reset` first")

    def set_elapsed_steps(self, elapsed_steps: int) -> None:
        """Sets how many steps count towards the time limit so far; a reset sets the number to 0.

        With the semantics "1.4.0" [default] it needs `persistent` in the config.

        Errors: `ValueError` for a number below 0 and, with "1.4.0", for a config that is not persistent.
        """
        check_elapsed_steps(self, self._fixed["persistent"], elapsed_steps)
        self._engine.elapsed = min(elapsed_steps, _LARGEST)

    @_only_persistent
    def get_history(self) -> list:
        """Returns for each agent its `AgentState` after the reset and after each later step that changed it.

        Needs `persistent` in the config.

        Rule: history/changes
        """
        self._check_started()
        return kept(self._engine, self.grid_config.obs_radius)

    @_only_persistent
    def get_full_history(self) -> list:
        """Returns for each agent its `AgentState` at every step so far, including the reset."""
        num_steps = self._engine.num_steps
        return [at_every_step(changes, num_steps) for changes in self.get_history()]

    agent_state_to_full_list = staticmethod(at_every_step)
    decompress_history = staticmethod(decompressed)
