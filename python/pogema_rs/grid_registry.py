"""The registry of maps that configs select by `map_name`."""

from __future__ import annotations

from typing import Optional

import numpy as np

from pogema_rs.errors import MapTextError, StateError
from pogema_rs.grid_config import GridConfig

__all__ = ["GRID_STR_REGISTRY", "RegisteredGrid", "get_grid", "in_registry", "register_grid"]

GRID_STR_REGISTRY: dict[str, RegisteredGrid] = {}


class RegisteredGrid:
    """A named map; its constructor registers it.

    Errors: `ValueError` for a name that is taken, or for letters in addition to positions; `KeyError` for an unknown
    character.

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
            raise StateError(f"the map {name!r} has letters alongside positions, expected one or the other")
        self.obstacles = np.array(read.map, dtype=np.int32)
        self.agents_xy = read.agents_xy or agents_positions
        self.targets_xy = read.targets_xy or agents_targets
        register_grid(self)

    def get_obstacles(self) -> np.ndarray:
        """Returns the map, 1 for an obstacle: int32 `(height, width)`."""
        return self.obstacles

    def get_agents_xy(self) -> Optional[list]:
        """Returns the starts given with the map."""
        return self.agents_xy

    def get_targets_xy(self) -> Optional[list]:
        """Returns the goals given with the map."""
        return self.targets_xy


def in_registry(name: Optional[str]) -> bool:
    """Returns whether a map of this name is registered."""
    return name in GRID_STR_REGISTRY


def get_grid(name: str) -> RegisteredGrid:
    """Returns the map of a name; raises `KeyError` for an unknown name."""
    if not in_registry(name):
        raise MapTextError(f"no map named {name!r} is registered")
    return GRID_STR_REGISTRY[name]


def register_grid(rg: RegisteredGrid) -> None:
    """Registers a map; raises `MapTextError`, a `KeyError` and `ValueError`, if its name is taken."""
    if in_registry(rg.name):
        raise MapTextError(f"a map named {rg.name!r} is already registered")
    GRID_STR_REGISTRY[rg.name] = rg


def map_text(name: Optional[str]) -> Optional[str]:
    """Returns the obstacles of a registered map as text, or `None` if the name is not registered."""
    if name is None or not in_registry(name):
        return None
    rows = GRID_STR_REGISTRY[name].get_obstacles()
    return "\n".join("".join("#" if cell else "." for cell in row) for row in rows)
