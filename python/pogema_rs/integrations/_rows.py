"""A `VecEnv` for frameworks that have one axis for the agents of all environments."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from pogema_rs.vec_env import NUM_ACTIONS, VecEnv

__all__ = ["AgentRows"]


class AgentRows:
    """A `VecEnv`, and the spaces and number of its agents; agent `agent` of `env` has row `env * agents + agent`."""

    def __init__(self, grid_config: Any, num_envs: Any, **options: Any) -> None:
        """Makes the environments; `grid_config` may be None.

        Errors: ValueError or TypeError for wrong arguments.
        """
        self.envs = VecEnv({} if grid_config is None else grid_config, num_envs, **options)
        space = self.envs.single_observation_space
        if not isinstance(space, spaces.Box):
            raise ValueError("the observations are dictionaries, expected observation_type 'default' without scalars")
        self.observation_space = spaces.Box(0, space.high.max(), space.shape[1:], space.dtype.type)
        self.action_space = spaces.Discrete(NUM_ACTIONS)
        self.by_env = (self.envs.num_envs, self.envs.num_agents)
        self.num_agents = self.envs.num_envs * self.envs.num_agents

    def actions(self, rows: Any) -> np.ndarray:
        """Returns the actions of all agents with the axes of a `VecEnv`.

        Errors: ValueError for another number of actions.
        """
        numbers = np.asarray(rows)
        if numbers.shape != (self.num_agents,):
            raise ValueError(f"actions have shape {numbers.shape}, expected ({self.num_agents},), one per agent")
        return numbers.reshape(self.by_env)
