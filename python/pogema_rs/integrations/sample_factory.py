"""Environments for Sample Factory."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

from pogema_rs.wrappers.forwarding import Wrapper

__all__ = ["AutoResetWrapper", "IsMultiAgentWrapper", "MetricsForwardingWrapper"]


class IsMultiAgentWrapper(Wrapper):
    """Says that there are several agents, and how many."""

    is_multiagent = True

    @property
    def num_agents(self) -> int:
        """Number of agents."""
        return self.unwrapped.get_num_agents()


class MetricsForwardingWrapper(Wrapper):
    """Puts a copy of the metrics where Sample Factory looks for them, `episode_extra_stats`."""

    def step(self, action: Any) -> Any:
        """As the environment inside."""
        result = self.env.step(action)
        for info in result[4]:
            if "metrics" in info:
                info["episode_extra_stats"] = deepcopy(info["metrics"])
        return result


class AutoResetWrapper(Wrapper):
    """Begins the next episode in the step that ends one: the observations are those of the new episode."""

    def step(self, action: Any) -> Any:
        """As the environment inside, but for the observations of a step that ends an episode."""
        observations, rewards, terminated, truncated, infos = self.env.step(action)
        if all(terminated) or all(truncated):
            observations, _ = self.env.reset()
        return observations, rewards, terminated, truncated, infos
