"""Environments for TorchRL, which reads them through its PettingZoo wrapper."""

from __future__ import annotations

from typing import Any, Optional, Union

import numpy as np

from pogema_rs.grid_config import GridConfig
from pogema_rs.integrations.pettingzoo import PogemaParallel
from pogema_rs.semantics import Semantics

__all__ = ["PogemaTorchRL"]

# POGEMA's metrics of an episode, by `on_target`.
_METRICS = {
    "finish": ("ISR", "CSR", "ep_length"),
    "nothing": ("ISR", "CSR", "ep_length", "SoC", "makespan"),
    "restart": ("avg_throughput",),
}


class PogemaTorchRL(PogemaParallel):
    """An environment for `torchrl.envs.PettingZooWrapper(..., use_mask=True)`.

    The infos of every step have the same flat fields:

    - `is_active`
    - `action_mask`, which TorchRL passes to its specs and policies: 5 flags, True for staying and for a move whose cell
      is on the map and not an obstacle
    - the metrics under POGEMA's names, the same for all agents, NaN before the step that ends the episode

    The default semantics are "2.0", because TorchRL chooses episodes with `reset(seed=...)`.
    """

    def __init__(
        self,
        grid_config: Optional[GridConfig] = None,
        render_mode: str = "ansi",
        semantics: Union[str, Semantics] = Semantics.DEVELOPED,
    ) -> None:
        super().__init__(grid_config or GridConfig(), render_mode, semantics)

    def reset(self, seed: Optional[int] = None, options: Optional[dict] = None) -> tuple[dict, dict]:
        """Begins an episode and returns observations and infos by name."""
        observations, infos = super().reset(seed=seed, options=options)
        return observations, self._flat(observations, infos)

    def step(self, actions: dict[str, int]) -> tuple[dict, dict, dict, dict, dict]:
        """Plays one step; agents without an action stay."""
        observations, rewards, terminated, truncated, infos = super().step(actions)
        return observations, rewards, terminated, truncated, self._flat(observations, infos)

    def _flat(self, observations: dict, infos: dict) -> dict:
        names = _METRICS[self.pogema.grid_config.on_target]
        metrics = {name: float((self.metrics or {}).get(name, np.nan)) for name in names}
        return {
            agent: {"is_active": info["is_active"], "action_mask": _free_moves(observations[agent]), **metrics}
            for agent, info in infos.items()
        }


def _free_moves(observation: Any) -> np.ndarray:
    """Returns the mask of actions that no obstacle blocks: staying, up, down, left, right."""
    obstacles = observation["obstacles"] if isinstance(observation, dict) else observation[0]
    center = len(obstacles) // 2
    around = [(center, center), (center - 1, center), (center + 1, center), (center, center - 1), (center, center + 1)]
    return np.array([obstacles[cell] == 0 for cell in around], dtype=np.bool_)
