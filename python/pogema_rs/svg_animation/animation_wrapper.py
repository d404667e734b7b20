"""Animations of episodes, saved as POGEMA saves them."""

from __future__ import annotations

import os
import warnings
from itertools import cycle
from os import PathLike
from typing import Any, Optional, Union

from pogema_rs._files import write_text
from pogema_rs._forward import forwarded
from pogema_rs._history import History, at_every_step, decompressed, kept
from pogema_rs.errors import NoHistoryError, NotResetError
from pogema_rs.grid_config import GridConfig
from pogema_rs.svg_animation._drawer import AnimationDrawer
from pogema_rs.svg_animation.animation_drawer import AnimationConfig, GridHolder, SvgSettings
from pogema_rs.wrappers.forwarding import Wrapper

__all__ = ["AnimationConfig", "AnimationDrawer", "AnimationMonitor", "GridHolder", "SvgSettings"]

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

    The engine draws the episodes. If `svg_settings` were changed, an `AnimationDrawer` draws them with these settings.
    In POGEMA's 2.0 line every environment can record and draw its episodes, and this class is deprecated.

    Source: POGEMA 1.4.0, `svg_animation/animation_wrapper.py`, `AnimationMonitor`
    """

    def __init__(self, env: Any, animation_config: Optional[AnimationConfig] = None) -> None:
        super().__init__(env)
        if self.unwrapped.semantics.deprecates_monitor:
            text = "AnimationMonitor is deprecated: call `enable_animation` and `save_animation` of the environment"
            warnings.warn(text, DeprecationWarning, stacklevel=2)
        self.svg_settings = SvgSettings()
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
                name = self.pick_name(self.unwrapped.grid_config, self._episode_idx)
                # A subclass that saves the animation itself expects the folder.
                os.makedirs(self.animation_config.directory, exist_ok=True)
                self.save_animation(os.path.join(self.animation_config.directory, name))
        return result

    def step_back(self) -> bool:
        """Takes the last step back and returns whether there was one; needs `persistent` in the config.

        Rule: history/step-back
        """
        # Not left to forwarding: as in POGEMA, a monitor has this method even if the config is not persistent.
        return self.env.step_back()

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
        """Writes the animation of the episode so far to a file, and creates missing parent folders.

        Errors: `NotResetError`, an `AttributeError`, before the first reset.
        """
        if self.unwrapped.grid is None:
            raise NotResetError("the environment has not been reset yet; call `reset` first")
        if self.svg_settings == SvgSettings():
            self.unwrapped.save_animation(name, animation_config)
        else:
            config = animation_config or AnimationConfig()
            # Raises the errors of the engine, because an `AnimationDrawer` checks nothing.
            self.unwrapped.render_animation(config)
            holder = self._holder(config)
            write_text(name, AnimationDrawer().create_animation(holder).render())

    @property
    def history(self) -> Optional[History]:
        """The `AgentState` of each agent after the reset and after each later step that changed it.

        The coordinates are those of the drawing: the map with a border of one cell. Before the first reset, the
        history is `None`.

        Rule: history/changes
        """
        if self._episode_idx == 0:
            return None
        return kept(self.unwrapped._engine, 1)

    def get_history(self) -> Optional[History]:
        """Returns `history`."""
        return self.history

    def get_full_history(self) -> History:
        """Returns for each agent its state at every step so far, in the coordinates of `history`."""
        history = self.history
        if history is None:
            raise NoHistoryError("the environment has not been reset yet; call `reset` first")
        return [at_every_step(changes, self.unwrapped._engine.num_steps) for changes in history]

    def _holder(self, config: AnimationConfig) -> GridHolder:
        """Returns the episode so far for an `AnimationDrawer`, cut as in POGEMA."""
        env, history = self.unwrapped, [[*states, states[-1]] for states in decompressed(self.history or [])]
        grid_config, trim = env.grid_config, env.grid_config.obs_radius - 1
        obstacles = env.get_obstacles()[trim : -trim or None, trim : -trim or None]
        if config.egocentric_idx is not None and grid_config.on_target == "finish":
            length = history[config.egocentric_idx][-1].step + 1
            history = [states[:length] for states in history]
        return GridHolder(
            obstacles=obstacles,
            episode_length=len(history[0]),
            height=obstacles.shape[1],
            width=obstacles.shape[0],
            colors=dict(zip(range(len(history)), cycle(self.svg_settings.colors))),
            history=history,
            obs_radius=grid_config.obs_radius,
            on_target=grid_config.on_target,
            config=config,
            svg_settings=self.svg_settings,
        )


def _all(ends: Any) -> bool:
    return all(ends) if isinstance(ends, (list, tuple)) else bool(ends)
