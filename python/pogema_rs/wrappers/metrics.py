"""Metrics as wrappers: a base class for custom metrics, and POGEMA's metrics for environments without them.

`pogema_v0` makes environments that measure POGEMA's metrics themselves; only a bare `pogema_rs.envs.Pogema` needs the
wrappers that derive from `AbstractMetric`.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, Optional

import numpy as np

from pogema_rs.wrappers.forwarding import Wrapper

__all__ = [
    "AbstractMetric",
    "AgentsDensityWrapper",
    "CSRMetric",
    "EpLengthMetric",
    "ISRMetric",
    "LifeLongAverageThroughputMetric",
    "NonDisappearCSRMetric",
    "NonDisappearEpLengthMetric",
    "NonDisappearISRMetric",
    "RuntimeMetricWrapper",
    "SumOfCostsAndMakespanMetric",
]


def _add(infos: list[dict], **metrics: float) -> None:
    infos[0].setdefault("metrics", {}).update(metrics)


class AbstractMetric(Wrapper):
    """A metric that a subclass computes in `_compute_stats`.

    As in POGEMA, a reset does not clear the counters of an episode that did not end.

    Rule: metrics/finish

    Source: POGEMA 1.4.0, `wrappers/metrics.py`, `AbstractMetric`
    """

    def __init__(self, env: Any) -> None:
        super().__init__(env)
        self._current_step = 0

    def _compute_stats(self, step: int, is_on_goal: Sequence[bool], finished: bool) -> Optional[dict[str, Any]]:
        """Returns the metrics to add, or `None`.

        `step` counts from 0, `is_on_goal` holds a flag for each agent, and `finished` is set in the step that ends the
        episode.
        """
        raise NotImplementedError

    def step(self, action: Any) -> Any:
        """Plays one step of the inner environment, and adds the metrics of the step, if any."""
        result = self.env.step(action)
        _, _, terminated, truncated, infos = result
        finished = all(truncated) or all(terminated)
        found = self._compute_stats(self._current_step, self.was_on_goal or [], finished)
        self._current_step = 0 if finished else self._current_step + 1
        if found:
            _add(infos, **found)
        return result


class _GoalCount(AbstractMetric):
    """A metric of the number of goals that agents reached since the last end of an episode."""

    def __init__(self, env: Any) -> None:
        super().__init__(env)
        self._solved_instances = 0

    def _compute_stats(self, step: int, is_on_goal: Sequence[bool], finished: bool) -> Optional[dict[str, Any]]:
        self._solved_instances += sum(is_on_goal)
        if not finished:
            return None
        count, self._solved_instances = self._solved_instances, 0
        return self._of(count)

    def _of(self, count: int) -> dict[str, Any]:
        raise NotImplementedError


class LifeLongAverageThroughputMetric(_GoalCount):
    """Adds `avg_throughput`: the total number of goals that agents reached, divided by the time limit in steps.

    Rule: metrics/restart
    """

    def _of(self, count: int) -> dict[str, Any]:
        return {"avg_throughput": count / self.grid_config.max_episode_steps}


class ISRMetric(_GoalCount):
    """Adds `ISR` with `on_target="finish"`: the share of agents that reached their goals.

    Rule: metrics/finish
    """

    def _of(self, count: int) -> dict[str, Any]:
        return {"ISR": count / self.get_num_agents()}


class CSRMetric(_GoalCount):
    """Adds `CSR` with `on_target="finish"`: 1.0 if all agents reached their goals, otherwise 0.0.

    Rule: metrics/finish
    """

    def _of(self, count: int) -> dict[str, Any]:
        return {"CSR": float(count == self.get_num_agents())}


class NonDisappearISRMetric(AbstractMetric):
    """Adds `ISR` with `on_target="nothing"`: the share of agents on their goals in the last step.

    Rule: metrics/nothing
    """

    def _compute_stats(self, step: int, is_on_goal: Sequence[bool], finished: bool) -> Optional[dict[str, Any]]:
        return {"ISR": float(sum(is_on_goal)) / self.get_num_agents()} if finished else None


class NonDisappearCSRMetric(AbstractMetric):
    """Adds `CSR` with `on_target="nothing"`: 1.0 if all agents are on their goals in the last step, otherwise 0.0.

    Rule: metrics/nothing
    """

    def _compute_stats(self, step: int, is_on_goal: Sequence[bool], finished: bool) -> Optional[dict[str, Any]]:
        return {"CSR": float(all(is_on_goal))} if finished else None


class NonDisappearEpLengthMetric(AbstractMetric):
    """Adds `ep_length` with `on_target="nothing"`: the number of steps.

    Rule: metrics/nothing
    """

    def _compute_stats(self, step: int, is_on_goal: Sequence[bool], finished: bool) -> Optional[dict[str, Any]]:
        return {"ep_length": step + 1} if finished else None


class _ArrivalTimes(AbstractMetric):
    """A metric of the step in which each agent arrives; the last step for an agent that does not."""

    #: Whether an agent that leaves its goal no longer counts as arrived.
    _forgets = False

    def __init__(self, env: Any) -> None:
        super().__init__(env)
        self._clear()

    def _clear(self) -> None:
        self._solve_time: list[Optional[int]] = [None] * self.get_num_agents()

    def _compute_stats(self, step: int, is_on_goal: Sequence[bool], finished: bool) -> Optional[dict[str, Any]]:
        for agent, on_goal in enumerate(is_on_goal):
            if self._solve_time[agent] is None and (on_goal or finished):
                self._solve_time[agent] = step
            elif self._forgets and not on_goal and not finished:
                self._solve_time[agent] = None
        if not finished:
            return None
        times = [time for time in self._solve_time if time is not None]
        self._clear()
        return self._of(times)

    def _of(self, times: list[int]) -> dict[str, Any]:
        raise NotImplementedError


class EpLengthMetric(_ArrivalTimes):
    """Adds `ep_length` with `on_target="finish"`: the mean number of steps until an agent arrives.

    Rule: metrics/finish
    """

    def _of(self, times: list[int]) -> dict[str, Any]:
        return {"ep_length": sum(times) / self.get_num_agents() + 1}


class SumOfCostsAndMakespanMetric(_ArrivalTimes):
    """Adds `SoC` and `makespan` with `on_target="nothing"`: the sum and the maximum of the agents' arrival times.

    Rule: metrics/nothing
    """

    _forgets = True

    def _of(self, times: list[int]) -> dict[str, Any]:
        return {"SoC": sum(times) + self.get_num_agents(), "makespan": max(times) + 1}


class AgentsDensityWrapper(Wrapper):
    """Adds `avg_agents_density`: agents per free cell of a window, averaged over agents and over observations.

    It needs observations of type `POMAPF` or `MAPF`.

    Rule: metrics/density
    """

    def __init__(self, env: Any) -> None:
        super().__init__(env)
        self._means: list[float] = []

    def count_agents(self, observations: Any) -> None:
        """Adds the density in the windows of these observations to the mean of the episode."""
        shares = []
        for seen in observations:
            num_free = seen["obstacles"].size - np.count_nonzero(seen["obstacles"])
            shares.append(np.count_nonzero(seen["agents"]) / num_free)
        self._means.append(np.mean(shares))

    def reset(self, **kwargs: Any) -> Any:
        """Resets the inner environment and the mean."""
        observations, infos = self.env.reset(**kwargs)
        self._means = []
        self.count_agents(observations)
        return observations, infos

    def step(self, actions: Any) -> Any:
        """Plays one step of the inner environment, and adds the metric if the step ends the episode."""
        observations, rewards, terminated, truncated, infos = self.env.step(actions)
        self.count_agents(observations)
        if all(terminated) or all(truncated):
            _add(infos, avg_agents_density=float(np.mean(self._means)))
        return observations, rewards, terminated, truncated, infos


class RuntimeMetricWrapper(Wrapper):
    """Adds `runtime`: the time from the reset to the end of the episode, minus the time in the environment's steps.

    Units: seconds.
    """

    def __init__(self, env: Any) -> None:
        super().__init__(env)
        self._began, self._in_steps = time.monotonic(), 0.0

    def reset(self, **kwargs: Any) -> Any:
        """Resets the inner environment and the clock."""
        result = self.env.reset(**kwargs)
        self._began, self._in_steps = time.monotonic(), 0.0
        return result

    def step(self, actions: Any) -> Any:
        """Plays one step of the inner environment, and adds the metric if the step ends the episode."""
        began = time.monotonic()
        observations, rewards, terminated, truncated, infos = self.env.step(actions)
        now = time.monotonic()
        self._in_steps += now - began
        if all(terminated) or all(truncated):
            _add(infos, runtime=now - self._began - self._in_steps)
        return observations, rewards, terminated, truncated, infos
