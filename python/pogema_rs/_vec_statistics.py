"""The episode statistics of a `VecEnv`, in the form of Gymnasium's `RecordEpisodeStatistics`."""

from __future__ import annotations

import time
from typing import Any, Optional

import numpy as np

from pogema_rs._vec_input import AutoresetMode


class EpisodeStatistics:
    """The return, the length and the duration of each environment's current episode."""

    def __init__(self, num_envs: int, mode: AutoresetMode) -> None:
        self._mode = mode
        self._returns = np.zeros(num_envs)
        self._lengths = np.zeros(num_envs, dtype=np.int64)
        self._starts = np.zeros(num_envs)
        self._is_over = np.zeros(num_envs, dtype=np.bool_)

    def begin(self, chosen: Optional[Any]) -> None:
        """Begins the episodes of the chosen environments [default: all]."""
        which = slice(None) if chosen is None else np.asarray(chosen)
        self._returns[which] = 0
        self._lengths[which] = 0
        self._starts[which] = time.perf_counter()
        self._is_over[which] = False

    def count(self, rewards: np.ndarray, agent_mask: np.ndarray) -> None:
        """Counts a step of the episodes that were not over before it. The rewards of padding are 0.

        Shape: `rewards` and `agent_mask` are `(num_envs, agents)`
        """
        means = rewards.sum(axis=1, dtype=np.float64) / agent_mask.sum(axis=1)
        self._returns += np.where(self._is_over, 0, means)
        self._lengths += ~self._is_over
        if self._mode == AutoresetMode.NEXT_STEP:
            # This step has begun the next episodes.
            self.begin(self._is_over)

    def end(self, ended: list[int]) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """Returns the statistics of the episodes that ended in the last step, and their mask.

        Shape: all `(num_envs,)`
        """
        present = np.zeros(len(self._is_over), dtype=np.bool_)
        present[ended] = True
        seconds = np.round(time.perf_counter() - self._starts, 6)
        values = {"r": self._returns, "l": self._lengths, "t": seconds}
        statistics = {name: np.where(present, value, 0) for name, value in values.items()}
        if self._mode == AutoresetMode.SAME_STEP:
            self.begin(present)
        else:
            self._is_over |= present
        return statistics, present
