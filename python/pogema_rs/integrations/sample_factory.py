"""Environments for Sample Factory."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

from pogema_rs.wrappers.forwarding import Wrapper

__all__ = ["AutoResetWrapper", "IsMultiAgentWrapper", "MetricsForwardingWrapper"]


class IsMultiAgentWrapper(Wrapper):
    """Adds the attributes `is_multiagent` and `num_agents`."""

    is_multiagent = True

    @property
    def num_agents(self) -> int:
        """Number of agents."""
        return int(self.get_num_agents())


class MetricsForwardingWrapper(Wrapper):
    """Copies the metrics to `episode_extra_stats`, where Sample Factory reads them."""

    def step(self, action: Any) -> Any:
        """Plays one step of the inner environment."""
        result = self.env.step(action)
        for info in result[4]:
            if "metrics" in info:
                info["episode_extra_stats"] = deepcopy(info["metrics"])
        return result


class AutoResetWrapper(Wrapper):
    """Begins the next episode in the step that ends one, and returns the new episode's observations."""

    def step(self, action: Any) -> Any:
        """Plays one step of the inner environment, and replaces the observations if the step ends an episode."""
        observations, rewards, terminated, truncated, infos = self.env.step(action)
        if all(terminated) or all(truncated):
            observations, _ = self.env.reset()
        return observations, rewards, terminated, truncated, infos
