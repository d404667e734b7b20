"""Environments for PyMARL and EPyMARL."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Optional, Union

import numpy as np

from pogema_rs.envs import _make_pogema
from pogema_rs.grid_config import GridConfig
from pogema_rs.semantics import Semantics

__all__ = ["PyMarlPogema"]


class PyMarlPogema:
    """An environment with PyMARL's interface: all agents share one reward and one state.

    Source: POGEMA 1.4.0, `integrations/pymarl.py`
    """

    spec = None

    def __init__(
        self,
        grid_config: GridConfig,
        mh_distance: bool = False,
        semantics: Union[str, Semantics] = Semantics.RELEASED,
    ) -> None:
        self.env = _make_pogema(grid_config, semantics)
        self._mh_distance = mh_distance
        self._observations: list
        self._observations, _ = self.env.reset()
        self.max_episode_steps = self.episode_limit = grid_config.max_episode_steps
        self.n_agents = self.env.get_num_agents()

    @property
    def unwrapped(self) -> PyMarlPogema:
        """This environment."""
        return self

    def reset(self) -> np.ndarray:
        """Begins an episode and returns the observations of all agents in one flat array."""
        self._observations, _ = self.env.reset()
        return np.array(self._observations).flatten()

    def step(self, actions: Sequence[int]) -> tuple[float, bool, dict]:
        """Plays one step and returns the sum of rewards, whether the episode ended, and if so its metrics.

        With `persistent` in the config there are no metrics.
        """
        self._observations, rewards, terminated, truncated, infos = self.env.step(actions)
        done = all(terminated) or all(truncated)
        return sum(rewards), done, dict(infos[0].get("metrics", {})) if done else {}

    def get_obs(self) -> np.ndarray:
        """Returns the observations of all agents, `(agents, 3 * side * side)`."""
        return np.array([self.get_obs_agent(agent) for agent in range(self.n_agents)])

    def get_obs_agent(self, agent_id: int) -> np.ndarray:
        """Returns the observation of one agent as a flat array."""
        return np.array(self._observations[agent_id]).flatten()

    def get_obs_size(self) -> int:
        """Returns the number of values in the observation of one agent."""
        return len(self.get_obs_agent(0))

    def get_state(self) -> np.ndarray:
        """See `Grid.get_state`."""
        return self.env.get_state()

    def get_state_size(self) -> int:
        """Returns the number of values in the state."""
        return len(self.get_state())

    def get_avail_actions(self) -> list[list[int]]:
        """Returns the numbers of all actions for each agent."""
        return [self.get_avail_agent_actions(agent) for agent in range(self.n_agents)]

    @staticmethod
    def get_avail_agent_actions(agent_id: int) -> list[int]:
        """Returns the numbers of all actions, as in POGEMA; PyMARL expects a flag for each action."""
        return list(range(PyMarlPogema.get_total_actions()))

    @staticmethod
    def get_total_actions() -> int:
        """Returns the number of actions."""
        return 5

    def get_env_info(self) -> dict[str, int]:
        """Returns the sizes that PyMARL requires."""
        return {
            "state_shape": self.get_state_size(),
            "obs_shape": self.get_obs_size(),
            "n_actions": self.get_total_actions(),
            "n_agents": self.n_agents,
            "episode_limit": self.episode_limit,
        }

    @staticmethod
    def get_stats() -> dict:
        """Returns an empty dictionary, because no statistics are kept."""
        return {}

    def sample_actions(self) -> np.ndarray:
        """Returns a random action for each agent."""
        return self.env.sample_actions()

    def render(self, *args: Any, **kwargs: Any) -> Optional[str]:
        """Prints the map, or returns its text if `mode` is "ansi"."""
        return self.env.render(*args, **kwargs)

    def save_replay(self) -> None:
        """Does nothing, as in POGEMA; `env.save_replay` writes a replay."""

    def close(self) -> None:
        """Does nothing."""
