"""The time limit as a wrapper, for environments without one."""

from __future__ import annotations

from typing import Any

from gymnasium.wrappers import TimeLimit

from pogema_rs._history import check_elapsed_steps
from pogema_rs.wrappers.forwarding import Wrapper

__all__ = ["MultiTimeLimit"]


class MultiTimeLimit(Wrapper, TimeLimit):  # type: ignore[misc]
    """Truncates all agents after `max_episode_steps` steps.

    `pogema_v0` makes environments that have a time limit; only a bare `pogema_rs.envs.Pogema` needs this wrapper.

    Rule: end/truncated

    Source: POGEMA 1.4.0, `wrappers/multi_time_limit.py`
    """

    _elapsed_steps: Any

    def step(self, action: Any) -> Any:
        """Plays one step of the inner environment."""
        observations, rewards, terminated, truncated, infos = self.env.step(action)
        self._elapsed_steps += 1
        if self._elapsed_steps >= self._max_episode_steps:
            truncated = [True] * self.get_num_agents()
        return observations, rewards, terminated, truncated, infos

    def set_elapsed_steps(self, elapsed_steps: int) -> None:
        """Sets how many steps count towards the limit so far; a reset sets the number to 0.

        With the semantics "1.4.0" [default] this method needs `persistent` in the config.

        Errors: `ValueError` for a number below 0, and with these semantics for a config that is not persistent.
        """
        check_elapsed_steps(self.unwrapped, self.unwrapped.grid_config.persistent, elapsed_steps)
        self._elapsed_steps = elapsed_steps
