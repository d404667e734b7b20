"""Environments for PufferLib that write into its buffers."""

from __future__ import annotations

from typing import Any, Optional, Union

import numpy as np
from gymnasium import spaces

from pogema_rs.semantics import Semantics
from pogema_rs.vec_env import NUM_ACTIONS, VecEnv

try:
    from pufferlib import PufferEnv
except ImportError as missing:
    raise ImportError("the PufferLib integration needs `pip install pufferlib`, 3.0 or later") from missing

__all__ = ["PogemaPuffer"]


class PogemaPuffer(PufferEnv):
    """A `VecEnv` as a native environment of PufferLib: every agent of every environment is one row of its buffers.

    Row `env * agents + agent` of `observations` `(num_agents, 3, side, side)`, `rewards`, `terminals` and
    `truncations` belongs to that agent. `masks` is False from the step after the one in which the agent finished until
    the next episode begins. The step that ends an episode also begins the next one. `infos` holds the metrics of each
    episode that ended.

    Pass the class to `pufferlib.vector.make`, and its arguments as `env_kwargs`. One instance steps `num_envs`
    environments on `num_threads` threads; if you run several processes, set `num_threads=1`.
    """

    def __init__(
        self,
        grid_config: Any = None,
        num_envs: Optional[int] = None,
        *,
        num_threads: Optional[int] = None,
        dtype: Union[str, np.dtype, type] = "float32",
        semantics: Union[str, Semantics] = Semantics.RELEASED,
        buf: Any = None,
        seed: Optional[int] = None,
    ) -> None:
        """Makes the environments like `VecEnv`; `buf` is PufferLib's, and a first reset without a seed uses `seed`.

        Errors: ValueError or TypeError for wrong arguments.
        """
        self.envs = VecEnv(
            {} if grid_config is None else grid_config,
            num_envs,
            num_threads=num_threads,
            dtype=dtype,
            semantics=semantics,
        )
        space = self.envs.single_observation_space
        if not isinstance(space, spaces.Box):
            raise ValueError("observation_type gives dictionaries, expected 'default'")
        self.single_observation_space = spaces.Box(0, space.high.max(), space.shape[1:], space.dtype.type)
        self.single_action_space = spaces.Discrete(NUM_ACTIONS)
        self.num_agents = self.envs.num_envs * self.envs.num_agents
        super().__init__(buf)
        self._by_env = (self.envs.num_envs, self.envs.num_agents)
        self._is_active = np.zeros(self.num_agents, dtype=np.bool_)
        self._seed = seed

    def reset(self, seed: Optional[int] = None) -> tuple[np.ndarray, list[dict[str, float]]]:
        """Begins the first episodes of a seed, or the next ones, and returns observations and an empty list."""
        seed, self._seed = self._seed if seed is None else seed, None
        _, infos = self.envs.reset(seed=seed, out=self._observations())
        self.rewards[:] = 0
        self.terminals[:] = False
        self.truncations[:] = False
        self._is_active = infos["is_active"].reshape(-1)
        self.masks[:] = self._is_active
        return self.observations, []

    def step(self, actions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, list[dict[str, float]]]:
        """Plays one step and returns the buffers of observations, rewards, terminals and truncations, and infos.

        Errors: those of `VecEnv.step`; the state does not change.
        """
        numbers = np.asarray(actions)
        if numbers.shape != (self.num_agents,):
            raise ValueError(f"actions have shape {numbers.shape}, expected ({self.num_agents},), one per agent")
        _, rewards, terminated, truncated, infos = self.envs.step(
            numbers.reshape(self._by_env), out=self._observations()
        )
        self.rewards[:] = rewards.reshape(-1)
        self.terminals[:] = terminated.reshape(-1)
        self.truncations[:] = truncated.reshape(-1)
        was_active, self._is_active = self._is_active, infos["is_active"].reshape(-1)
        self.masks[:] = was_active | self._is_active
        return self.observations, self.rewards, self.terminals, self.truncations, _episodes(infos)

    def close(self) -> None:
        """Frees the environments and their threads."""
        self.envs.close()

    def _observations(self) -> np.ndarray:
        """Returns PufferLib's buffer with the axes of a `VecEnv`."""
        return self.observations.reshape(*self._by_env, *self.single_observation_space.shape)


def _episodes(infos: dict[str, Any]) -> list[dict[str, float]]:
    """Returns the metrics of each episode that ended."""
    if "metrics" not in infos:
        return []
    metrics = {name: values for name, values in infos["metrics"].items() if not name.startswith("_")}
    return [{name: float(values[env]) for name, values in metrics.items()} for env in np.flatnonzero(infos["_metrics"])]
