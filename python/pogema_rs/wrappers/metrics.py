"""Metrics that environments do not measure themselves."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from pogema_rs.wrappers.forwarding import Wrapper

__all__ = ["AgentsDensityWrapper", "RuntimeMetricWrapper"]


def _add(infos: list[dict], **metrics: float) -> None:
    infos[0].setdefault("metrics", {}).update(metrics)


class AgentsDensityWrapper(Wrapper):
    """Adds `avg_agents_density`: agents per free cell of a window, averaged over agents and over observations.

    It needs observations of type `POMAPF` or `MAPF`.

    Rule: metrics/density
    """

    _means: list[float]

    def _count(self, observations: list[dict]) -> None:
        shares = []
        for seen in observations:
            num_free = seen["obstacles"].size - np.count_nonzero(seen["obstacles"])
            shares.append(np.count_nonzero(seen["agents"]) / num_free)
        self._means.append(np.mean(shares))

    def reset(self, **kwargs: Any) -> Any:
        """Resets the inner environment and the mean."""
        observations, infos = self.env.reset(**kwargs)
        self._means = []
        self._count(observations)
        return observations, infos

    def step(self, action: Any) -> Any:
        """Plays one step of the inner environment, and adds the metric if it ends the episode."""
        observations, rewards, terminated, truncated, infos = self.env.step(action)
        self._count(observations)
        if all(terminated) or all(truncated):
            _add(infos, avg_agents_density=float(np.mean(self._means)))
        return observations, rewards, terminated, truncated, infos


class RuntimeMetricWrapper(Wrapper):
    """Adds `runtime`: the time from the reset to the end of the episode, minus the time in the environment's steps.

    Units: seconds.
    """

    def reset(self, **kwargs: Any) -> Any:
        """Resets the inner environment and the clock."""
        result = self.env.reset(**kwargs)
        self._began, self._in_steps = time.monotonic(), 0.0
        return result

    def step(self, action: Any) -> Any:
        """Plays one step of the inner environment, and adds the metric if it ends the episode."""
        began = time.monotonic()
        observations, rewards, terminated, truncated, infos = self.env.step(action)
        now = time.monotonic()
        self._in_steps += now - began
        if all(terminated) or all(truncated):
            _add(infos, runtime=now - self._began - self._in_steps)
        return observations, rewards, terminated, truncated, infos
