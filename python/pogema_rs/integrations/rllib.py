"""Environments for RLlib."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Optional

from pogema_rs.grid_config import GridConfig
from pogema_rs.integrations.pettingzoo import PogemaParallel
from pogema_rs.semantics import Semantics

try:
    from ray.rllib.env.multi_agent_env import MultiAgentEnv
except ImportError as missing:
    raise ImportError("the RLlib integration needs `pip install ray[rllib]`") from missing

__all__ = ["PogemaMultiAgentEnv"]


class PogemaMultiAgentEnv(MultiAgentEnv):
    """An environment with RLlib's dictionaries, keyed by agents `player_0`, `player_1` and so on.

    RLlib makes it from an `env_config` with the fields of a `GridConfig` and `semantics` [default: "2.0", because RLlib
    chooses episodes with `reset(seed=...)`]. When an episode ends, the infos of the agents that were active until then
    hold its metrics under `metrics`.
    """

    def __init__(self, env_config: Optional[Mapping[str, Any]] = None) -> None:
        fields = dict(env_config or {})
        semantics = fields.pop("semantics", Semantics.DEVELOPED)
        self._env = PogemaParallel(GridConfig(**fields), semantics=semantics)
        self.pogema, self.possible_agents = self._env.pogema, self._env.possible_agents
        self.agents: list[str] = []
        self.observation_spaces, self.action_spaces = self._env.observation_spaces, self._env.action_spaces
        super().__init__()

    def reset(self, *, seed: Optional[int] = None, options: Optional[dict] = None) -> tuple[dict, dict]:
        """Begins an episode and returns observations and infos by name."""
        observations, infos = self._env.reset(seed=seed, options=options)
        self.agents = self._env.agents
        return observations, infos

    def step(self, action_dict: Mapping[str, int]) -> tuple[dict, dict, dict, dict, dict]:
        """Plays one step and returns the values of the agents that were active before it.

        Agents without an action stay.
        """
        observations, rewards, terminated, truncated, infos = self._env.step(dict(action_dict))
        if self._env.metrics is not None:
            for info in infos.values():
                info["metrics"] = self._env.metrics
        terminated["__all__"], truncated["__all__"] = self._env._are_all_terminated, self._env._are_all_truncated
        self.agents = self._env.agents
        return observations, rewards, terminated, truncated, infos

    def render(self) -> Optional[str]:
        """Prints the map."""
        return self.pogema.render()
