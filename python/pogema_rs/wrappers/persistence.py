"""The history of an environment as a wrapper."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional

from pogema_rs._history import AgentState, History, at_every_step, last_change
from pogema_rs.errors import NoHistoryError
from pogema_rs.wrappers.forwarding import Wrapper

if TYPE_CHECKING:
    from pogema_rs.grid import Grid

__all__ = ["AgentState", "PersistentWrapper"]


class PersistentWrapper(Wrapper):
    """Records the history of an environment.

    With `persistent` in the config, the environment also keeps its own history.

    `xy_offset` is added to each coordinate [default: none].

    Rule: history/changes

    Source: POGEMA 1.4.0, `wrappers/persistence.py`, `PersistentWrapper`
    """

    def __init__(self, env: Any, xy_offset: Optional[int] = None) -> None:
        super().__init__(env)
        self._xy_offset = xy_offset
        self._step: Optional[int] = None
        self._changes: Optional[History] = None

    def reset(self, **kwargs: Any) -> Any:
        """Resets the inner environment and begins a new history."""
        result = self.env.reset(**kwargs)
        self._step = 0
        self._changes = [[state] for state in self._states()]
        return result

    def step(self, action: Any) -> Any:
        """Plays one step of the inner environment and records it."""
        history = self._started()
        result = self.env.step(action)
        self._step = (self._step or 0) + 1
        for changes, state in zip(history, self._states()):
            if state != changes[-1]:
                changes.append(state)
        return result

    def step_back(self) -> bool:
        """Undoes the last step and returns whether there was one; needs `persistent` in the config.

        Rule: history/step-back
        """
        history = self._started()
        if not self._step:
            return False
        self.unwrapped.step_back()
        self._step -= 1
        # An inner `MultiTimeLimit` has its own step count.
        self.env.set_elapsed_steps(self._step)
        for changes in history:
            if changes[-1].step > self._step:
                changes.pop()
        return True

    def get_history(self) -> Optional[History]:
        """Returns for each agent its state after the reset and after each later step that changed it.

        Before the first reset it returns `None`.
        """
        return self._changes

    def get_full_history(self) -> History:
        """Returns for each agent its state at every step so far, including the reset."""
        return [self.agent_state_to_full_list(changes, self._step or 0) for changes in self._started()]

    agent_state_to_full_list = staticmethod(at_every_step)

    @classmethod
    def decompress_history(cls, history: History) -> History:
        """Returns the state of each agent at each step, up to the last step with a change."""
        num_steps = last_change(history)
        return [cls.agent_state_to_full_list(changes, num_steps) for changes in history]

    def _started(self) -> History:
        if self._changes is None:
            raise NoHistoryError("the environment has not been reset yet; call `reset` first")
        return self._changes

    def _get_agent_state(self, grid: Grid, agent_idx: int) -> AgentState:
        """Returns the current state of one agent; a subclass may override this method."""
        return self._now()[agent_idx]

    def _states(self) -> list[AgentState]:
        if type(self)._get_agent_state is PersistentWrapper._get_agent_state:
            return self._now()
        grid = self.unwrapped._started()
        return [self._get_agent_state(grid, agent) for agent in range(grid.config.num_agents)]

    def _now(self) -> list[AgentState]:
        grid, shift, step = self.unwrapped._started(), self._xy_offset or 0, self._step or 0
        return [
            AgentState(row + shift, col + shift, goal_row + shift, goal_col + shift, step, active)
            for (row, col), (goal_row, goal_col), active in zip(
                grid.positions_xy, grid.finishes_xy, grid.is_active.values()
            )
        ]
