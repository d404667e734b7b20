"""The environment of suites: POGEMA on named maps."""

from __future__ import annotations

import copy
import re
from typing import Any, ClassVar, Literal, Optional

import numpy as np

from pogema_rs._engine import did_you_mean
from pogema_rs.errors import MapTextError
from pogema_rs.grid_config import GridConfig
from pogema_rs.install import is_installed
from pogema_rs.integrations.make_pogema import pogema_v0
from pogema_rs.svg_animation.animation_wrapper import AnimationConfig, AnimationMonitor
from pogema_rs.toolbox._toolbox_maps import LOGO
from pogema_rs.toolbox.registry import ToolboxRegistry
from pogema_rs.wrappers import Wrapper
from pogema_rs.wrappers.metrics import RuntimeMetricWrapper

__all__ = ["Environment", "MultiMapWrapper", "ProvideGlobalObstacles", "create_env_base"]


class Environment(GridConfig):
    """The fields of an environment in a suite.

    `occupancy`, `reward` and `limits` are this project's, as in suites for `pogema evaluate`.

    Source: pogema-toolbox 0.1.1, `create_env.py`, `Environment`
    """

    name: str = "Environment"
    with_animation: bool = False
    use_maps: bool = True
    occupancy: Literal["as_released", "exact"] = "as_released"
    reward: Literal["own", "shared"] = "own"
    limits: Literal["as_released", "extended"] = "as_released"

    _EXTENSIONS: ClassVar[tuple[str, ...]] = ("occupancy", "reward", "limits")


class ProvideGlobalObstacles(Wrapper):
    """Gives planners access to the whole map."""

    def get_global_obstacles(self) -> list[list[int]]:
        """Returns the map with its border, 1 for an obstacle."""
        return self.grid.get_obstacles().astype(int).tolist()

    def get_global_agents_xy(self) -> Any:
        """Returns the cell of each agent on the map with its border."""
        return self.grid.get_agents_xy()

    def get_global_targets_xy(self) -> Any:
        """Returns the goal of each agent on the map with its border."""
        return self.grid.get_targets_xy()


class MultiMapWrapper(Wrapper):
    """Chooses at each reset, by the seed, one of the maps whose names match the pattern `map_name` of the config.

    Errors: `MapTextError`, a KeyError, if no name matches.

    Source: pogema-toolbox 0.1.1, `create_env.py`, `MultiMapWrapper`
    """

    def __init__(self, env: Any) -> None:
        super().__init__(env)
        config = self.env.unwrapped.grid_config
        pattern = config.map_name
        # The environment's config gets starts, goals and the number of agents from each chosen map. They may not fit
        # the next map.
        self._fields = config.model_dump(exclude_unset=True, exclude={"width", "height", "size", "map"})
        self._names: list[str] = []
        if pattern:
            maps = ToolboxRegistry.get_maps()
            # In pogema-toolbox, the name of a map is a pattern too: `a.b` also matches `a-b`.
            if pattern not in maps or is_installed("pogema_toolbox"):
                self._names = _matching(pattern, list(maps))
            if pattern in maps and not self._names:
                self._names = [pattern]
            if not self._names:
                raise MapTextError(_unmatched(pattern, bool(_matching(pattern, [LOGO])), list(maps)))

    def reset(self, seed: Optional[int] = None, **kwargs: Any) -> tuple[Any, Any]:
        """Begins an episode; the default seed is that of the config."""
        config = self.env.unwrapped.grid_config
        seed = config.seed if seed is None else seed
        if self._names:
            name = self._names[np.random.default_rng(seed).integers(0, len(self._names))]
            fields = {**self._fields, "map": ToolboxRegistry.get_maps()[name], "map_name": name, "seed": seed}
            self.env.unwrapped.grid_config = type(config)(**copy.deepcopy(fields))
        return self.env.reset(seed=seed, **kwargs)


def _matching(pattern: str, names: list[str]) -> list[str]:
    """Returns the sorted names that match a pattern, or an empty list if the pattern is not a regular expression."""
    try:
        is_meant = re.compile(f"^{pattern}$").match
    except re.error:
        return []
    return sorted(filter(is_meant, names))


def _unmatched(pattern: str, is_logo: bool, names: list[str]) -> str:
    if is_logo:
        return f"no map matches `{pattern}`; `{LOGO}` is part of pogema-toolbox: `pip install --no-deps pogema-toolbox`"
    hint = did_you_mean(pattern, names) if names else ", and no map is registered"
    return f"no map matches `{pattern}`{hint}"


def create_env_base(config: Environment) -> Any:
    """Makes the environment of a suite, which measures all metrics of the results.

    After `install_as_pogema(toolbox=True)` the environment measures only the metrics of pogema-toolbox: run times,
    density and blocked moves are left out.

    Source: pogema-toolbox 0.1.1, `create_env.py`, `create_env_base`
    """
    env: Wrapper = ProvideGlobalObstacles(pogema_v0(grid_config=config))
    if config.use_maps:
        env = MultiMapWrapper(env)
    if config.with_animation:
        env = AnimationMonitor(env, AnimationConfig(directory="experiments/renders", save_every_idx_episode=None))
    if is_installed("pogema_toolbox"):
        return env
    env.unwrapped._engine.measure()
    return RuntimeMetricWrapper(env)
