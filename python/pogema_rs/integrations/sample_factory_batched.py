"""Environments for the batched sampling of Sample Factory."""

from __future__ import annotations

from typing import Any, Optional, Union

import gymnasium
import numpy as np
from gymnasium import spaces

from pogema_rs.integrations._rows import AgentRows
from pogema_rs.semantics import Semantics

try:
    import torch
except ImportError as missing:
    raise ImportError("batched sampling needs `pip install sample-factory`, 2.0 or later") from missing

__all__ = ["PogemaSampleFactory"]


class PogemaSampleFactory(gymnasium.Env):
    """A `VecEnv` as one multi-agent environment of Sample Factory: every agent of every environment is one actor.

    The arrays are `obs` `(num_agents, 3, side, side)`, rewards as float32, and `terminated` and `truncated` as bool.
    Row `env * agents + agent` of each array belongs to that agent of that environment. All actors of an environment end
    together, in the step that ends its episode and begins the next one. An agent that finished earlier remains an
    actor, with rewards of 0, and is terminated in that step. If the time limit ended the episode, the agents that are
    not terminated are truncated.

    Run Sample Factory with `batched_sampling=True` and one `PogemaSampleFactory` for each worker. Each
    `PogemaSampleFactory` holds `num_envs` environments. Sample Factory seeds each worker differently. In a step that
    ends an episode, the infos hold its metrics under POGEMA's names, as tensors `(num_agents,)`, from which Sample
    Factory makes its summaries.
    """

    is_multiagent = True

    def __init__(
        self,
        grid_config: Any = None,
        num_envs: Optional[int] = None,
        *,
        num_threads: Optional[int] = 1,
        dtype: Union[str, np.dtype, type] = "float32",
        semantics: Union[str, Semantics] = Semantics.RELEASED,
        render_mode: Optional[str] = None,
    ) -> None:
        """Makes the environments like `VecEnv`. The default of `num_threads` is 1: each worker is a process.

        Errors: ValueError or TypeError for wrong arguments.
        """
        self._rows = AgentRows(
            grid_config, num_envs, num_threads=num_threads, dtype=dtype, semantics=semantics, double_buffer=True
        )
        self.envs = self._rows.envs
        self.observation_space = spaces.Dict({"obs": self._rows.observation_space})
        self.action_space: spaces.Discrete = self._rows.action_space
        self.num_agents = self._rows.num_agents
        self.render_mode = render_mode

    def reset(
        self, *, seed: Optional[int] = None, options: Optional[dict[str, Any]] = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Begins the first episodes of a seed; without a seed, begins the next episodes.

        Returns the observations and an empty dictionary.
        """
        observations, _ = self.envs.reset(seed=seed, options=options)
        return self._by_agent(observations), {}

    def step(  # type: ignore[override]
        self, action: Any
    ) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Plays one step and returns observations, rewards, terminated, truncated and infos.

        Errors: those of `VecEnv.step`. After an error the state is unchanged.
        """
        observations, rewards, terminated, truncated, infos = self.envs.step(self._rows.actions(action))
        is_over = terminated.all(axis=1, keepdims=True) | truncated.all(axis=1, keepdims=True)
        seen, metrics = self._by_agent(observations), self._metrics(infos)
        done, cut = (is_over & terminated).reshape(-1), (is_over & ~terminated).reshape(-1)
        return seen, rewards.reshape(-1), done, cut, metrics

    def close(self) -> None:
        """Frees the environments and their threads."""
        self.envs.close()

    def _by_agent(self, observations: np.ndarray) -> dict[str, np.ndarray]:
        return {"obs": observations.reshape(self.num_agents, *observations.shape[2:])}

    def _metrics(self, infos: dict[str, Any]) -> dict[str, Any]:
        """Returns the metrics of the episodes that ended; Sample Factory reads the rows of actors that are done."""
        metrics = infos.get("metrics", {})
        return {
            name: torch.from_numpy(np.repeat(values, self.envs.num_agents))
            for name, values in metrics.items()
            if not name.startswith("_")
        }
