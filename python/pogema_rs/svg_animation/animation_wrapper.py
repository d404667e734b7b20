"""Animations of episodes, saved as POGEMA saves them."""

from __future__ import annotations

import os
from os import PathLike
from typing import Any, Optional, Union

from pogema_rs._forward import forwarded
from pogema_rs.grid_config import GridConfig
from pogema_rs.svg_animation.animation_drawer import AnimationConfig
from pogema_rs.wrappers.forwarding import Wrapper

__all__ = ["AnimationConfig", "AnimationMonitor"]

# POGEMA's module offers these names too.
__getattr__, __dir__ = forwarded(
    __name__,
    {
        "AgentState": "wrappers.persistence",
        "PersistentWrapper": "wrappers.persistence",
    },
)


class AnimationMonitor(Wrapper):
    """Records the episodes of an environment and saves those that its config selects.

    As in POGEMA, the k-th episode begun is saved unless k + 1 is a multiple of `save_every_idx_episode`. If that field
    is 1, every episode is saved.

    Source: POGEMA 1.4.0, `svg_animation/animation_wrapper.py`, `AnimationMonitor`
    """

    def __init__(self, env: Any, animation_config: Optional[AnimationConfig] = None) -> None:
        super().__init__(env)
        self.animation_config = animation_config or AnimationConfig()
        self._episode_idx = 0
        env.unwrapped.enable_animation()

    def reset(self, **kwargs: Any) -> Any:
        """Resets the inner environment."""
        result = self.env.reset(**kwargs)
        self._episode_idx += 1
        return result

    def step(self, action: Any) -> Any:
        """Plays one step of the inner environment, and saves the episode if it ends and is selected."""
        result = self.env.step(action)
        _, _, terminated, truncated, _ = result
        if _all(terminated) or _all(truncated):
            every = self.animation_config.save_every_idx_episode
            if every and ((self._episode_idx + 1) % every or every == 1):
                os.makedirs(self.animation_config.directory, exist_ok=True)
                name = self.pick_name(self.unwrapped.grid_config, self._episode_idx)
                self.save_animation(os.path.join(self.animation_config.directory, name))
        return result

    @staticmethod
    def pick_name(grid_config: Optional[GridConfig], episode_idx: Optional[int] = None, zfill_ep: int = 5) -> str:
        """Returns the file name of an episode, which contains its number, map and seed."""
        parts = ["pogema"]
        if episode_idx is not None:
            parts.append(f"ep{str(episode_idx).zfill(zfill_ep)}")
        if grid_config is None:
            parts.append("render")
        else:
            parts += [grid_config.map_name] if grid_config.map_name else []
            parts += [f"seed{grid_config.seed}"] if grid_config.seed is not None else []
        return "-".join(parts) + ".svg"

    def save_animation(
        self, name: Union[str, PathLike] = "render.svg", animation_config: Optional[AnimationConfig] = None
    ) -> None:
        """Writes the animation of the episode so far to a file."""
        self.unwrapped.save_animation(name, animation_config)


def _all(ends: Any) -> bool:
    return all(ends) if isinstance(ends, (list, tuple)) else bool(ends)
