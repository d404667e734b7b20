"""Environments for PufferLib that write into its buffers."""

from __future__ import annotations

from typing import Any, Optional, Union

import numpy as np

from pogema_rs.integrations._rows import AgentRows
from pogema_rs.semantics import Semantics

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
        self._rows = AgentRows(grid_config, num_envs, num_threads=num_threads, dtype=dtype, semantics=semantics)
        self.envs = self._rows.envs
        self.single_observation_space = self._rows.observation_space
        self.single_action_space = self._rows.action_space
        self.num_agents = self._rows.num_agents
        super().__init__(buf)
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

        Errors: those of `VecEnv.step`. After an error the state is unchanged.
        """
        _, rewards, terminated, truncated, infos = self.envs.step(self._rows.actions(actions), out=self._observations())
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
        return self.observations.reshape(*self._rows.by_env, *self.single_observation_space.shape)


def _episodes(infos: dict[str, Any]) -> list[dict[str, float]]:
    """Returns the metrics of each episode that ended."""
    if "metrics" not in infos:
        return []
    metrics = {name: values for name, values in infos["metrics"].items() if not name.startswith("_")}
    return [{name: float(values[env]) for name, values in metrics.items()} for env in np.flatnonzero(infos["_metrics"])]
