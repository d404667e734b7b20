"""Maps by name: an environment whose config names one plays on it."""

from __future__ import annotations

from typing import Optional

import numpy as np

from pogema_rs.errors import MapTextError, StateError
from pogema_rs.grid_config import GridConfig

__all__ = ["GRID_STR_REGISTRY", "RegisteredGrid", "get_grid", "in_registry", "register_grid"]

GRID_STR_REGISTRY: dict[str, RegisteredGrid] = {}


class RegisteredGrid:
    """A map with a name, registered by being made.

    Errors: `ValueError` for a name that is taken or places given twice; `KeyError` for a character without a meaning.

    Rule: grid/named
    """

    FREE = 0
    OBSTACLE = 1

    def __init__(
        self,
        name: str,
        grid_str: str,
        agents_positions: Optional[list] = None,
        agents_targets: Optional[list] = None,
    ) -> None:
        self.name = name
        self.grid_str = grid_str
        self.agents_positions = agents_positions
        self.agents_targets = agents_targets
        read = GridConfig(map=grid_str)
        if agents_positions and read.agents_xy or agents_targets and read.targets_xy:
            raise StateError(f"the map {name!r} has letters beside positions, expected one or the other")
        self.obstacles = np.array(read.map, dtype=np.int32)
        self.agents_xy = read.agents_xy or agents_positions
        self.targets_xy = read.targets_xy or agents_targets
        register_grid(self)

    def get_obstacles(self) -> np.ndarray:
        """1 where there is an obstacle, int32 `(height, width)`."""
        return self.obstacles

    def get_agents_xy(self) -> Optional[list]:
        """The starts that came with the map."""
        return self.agents_xy

    def get_targets_xy(self) -> Optional[list]:
        """The goals that came with the map."""
        return self.targets_xy


def in_registry(name: Optional[str]) -> bool:
    """Whether a map of this name is registered."""
    return name in GRID_STR_REGISTRY


def get_grid(name: str) -> RegisteredGrid:
    """The map of a name; `KeyError` if there is none."""
    if not in_registry(name):
        raise MapTextError(f"no map is registered as {name!r}")
    return GRID_STR_REGISTRY[name]


def register_grid(rg: RegisteredGrid) -> None:
    """Registers a map; `KeyError` and `ValueError` if its name is taken."""
    if in_registry(rg.name):
        raise MapTextError(f"a map is registered as {rg.name!r} already")
    GRID_STR_REGISTRY[rg.name] = rg


def map_text(name: Optional[str]) -> Optional[str]:
    """The obstacles of a registered map as text; none if there is no such map."""
    if name is None or not in_registry(name):
        return None
    rows = GRID_STR_REGISTRY[name].get_obstacles()
    return "\n".join("".join("#" if cell else "." for cell in row) for row in rows)
