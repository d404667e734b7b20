"""Environments for RLlib."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Optional

from gymnasium import spaces

from pogema_rs.envs import _make_pogema
from pogema_rs.grid_config import GridConfig
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
        self.pogema = _make_pogema(GridConfig(**fields), semantics)
        self.possible_agents = [f"player_{agent}" for agent in range(self.pogema.get_num_agents())]
        self.agents: list[str] = []
        space, num_actions = self.pogema.observation_space, int(self.pogema.action_space.n)
        self.observation_spaces = {name: space for name in self.possible_agents}
        self.action_spaces = {name: spaces.Discrete(num_actions) for name in self.possible_agents}
        super().__init__()

    def reset(self, *, seed: Optional[int] = None, options: Optional[dict] = None) -> tuple[dict, dict]:
        """Begins an episode and returns observations and infos by name."""
        observations, infos = self.pogema.reset(seed=seed, options=options)
        self.agents = self.possible_agents[:]
        return dict(zip(self.agents, observations)), dict(zip(self.agents, infos))

    def step(self, action_dict: Mapping[str, int]) -> tuple[dict, dict, dict, dict, dict]:
        """Plays one step and returns the values of the agents that were active before it.

        Agents without an action stay.
        """
        result = self.pogema.step([action_dict.get(name, 0) for name in self.possible_agents])
        playing = set(self.agents)
        present = [(agent, name) for agent, name in enumerate(self.possible_agents) if name in playing]
        by_name: list[dict[str, Any]] = [{name: values[agent] for agent, name in present} for values in result]
        observations, rewards, terminated, truncated, infos = by_name
        metrics = result[4][0].get("metrics")
        if metrics is not None:
            for info in infos.values():
                info["metrics"] = metrics
        terminated["__all__"], truncated["__all__"] = all(result[2]), all(result[3])
        is_over = terminated["__all__"] or truncated["__all__"]
        active = self.pogema._started().is_active
        self.agents = [name for agent, name in present if active[agent] and not is_over]
        return observations, rewards, terminated, truncated, infos

    def render(self) -> Optional[str]:
        """Prints the map."""
        return self.pogema.render()
