"""The registry of maps that configs select by `map_name`."""

from __future__ import annotations

from typing import Optional

import numpy as np

from pogema_rs import _engine, _map_text
from pogema_rs._map_text import Cell
from pogema_rs.errors import MapTextError, StateError
from pogema_rs.utils import check_grid, grid_to_str, render_grid

__all__ = ["GRID_STR_REGISTRY", "RegisteredGrid", "get_grid", "in_registry", "register_grid"]

GRID_STR_REGISTRY: dict[str, RegisteredGrid] = {}


class RegisteredGrid:
    """A named map; its constructor registers it.

    Errors: `ValueError` for a name that is taken, or for letters in addition to positions; `KeyError` for an unknown
    character; `AssertionError` for rows of unequal length; those of `check_grid` for starts and goals that do not fit.

    Rule: grid/named
    """

    FREE = 0
    OBSTACLE = 1

    def __init__(
        self,
        name: str,
        grid_str: Optional[str] = None,
        agents_positions: Optional[list] = None,
        agents_targets: Optional[list] = None,
    ) -> None:
        if grid_str is None:
            raise MapTextError(f"the map {name!r} has no text, expected rows of `.`, `#` and letters")
        self.name = name
        self.grid_str = grid_str
        self.agents_positions = agents_positions
        self.agents_targets = agents_targets
        rows, starts, goals = self.str_to_grid(grid_str)
        if agents_positions and starts or agents_targets and goals:
            raise StateError(f"the map {name!r} has letters alongside positions, expected one or the other")
        self.obstacles = np.array(rows, dtype=np.int32)
        self.agents_xy = _sorted(starts) or agents_positions
        self.targets_xy = _sorted(goals) or agents_targets
        if not in_registry(name):  # `register_grid` reports a taken name
            check_grid(self.obstacles, self.agents_xy, self.targets_xy)
        register_grid(self)

    def str_to_grid(self, grid_str: str) -> tuple[list[list[int]], dict[str, Cell], dict[str, Cell]]:
        """Returns the rows of a map text, and the starts and goals by lower-case letter.

        Errors: `KeyError` for an unknown character, `AssertionError` for rows of unequal length.
        """
        rows, cells = _map_text.read(grid_str, _map_text.SIGNS)
        obstacles = [[self.OBSTACLE if sign == "#" else self.FREE for sign in row] for row in rows]
        last = {sign: cells[sign][-1] for sign in cells}
        starts = {sign: cell for sign, cell in last.items() if sign.islower()}
        return obstacles, starts, {sign.lower(): cell for sign, cell in last.items() if sign.isupper()}

    def get_obstacles(self) -> np.ndarray:
        """Returns the map, 1 for an obstacle: int32 `(height, width)`."""
        return self.obstacles

    def get_agents_xy(self) -> Optional[list]:
        """Returns the starts given with the map."""
        return self.agents_xy

    def get_targets_xy(self) -> Optional[list]:
        """Returns the goals given with the map."""
        return self.targets_xy

    def render(self) -> None:
        """Prints the map with its starts and goals in colours."""
        render_grid(self.get_obstacles(), self.get_agents_xy(), self.get_targets_xy())


def _sorted(cells: dict[str, Cell]) -> list[list[int]]:
    return [list(cell) for _, cell in sorted(cells.items())]


def in_registry(name: Optional[str]) -> bool:
    """Returns whether a map of this name is registered."""
    return name in GRID_STR_REGISTRY


def get_grid(name: str) -> RegisteredGrid:
    """Returns the map of a name; raises `KeyError` for an unknown name."""
    if not in_registry(name):
        hint = _engine.did_you_mean(str(name), list(GRID_STR_REGISTRY)) or "; register it with `RegisteredGrid` first"
        raise MapTextError(f"no map named {name!r} is registered{hint}")
    return GRID_STR_REGISTRY[name]


def register_grid(rg: RegisteredGrid) -> None:
    """Registers a map. If its name is taken, raises `MapTextError`, which is a `KeyError` and a `ValueError`."""
    if in_registry(rg.name):
        raise MapTextError(f"a map named {rg.name!r} is already registered")
    GRID_STR_REGISTRY[rg.name] = rg


def map_text(name: Optional[str]) -> Optional[str]:
    """Returns the obstacles of a registered map as text, or `None` if the name is not registered."""
    grid = obstacles(name)
    return None if grid is None else grid_to_str(grid)


def obstacles(name: Optional[str]) -> Optional[np.ndarray]:
    """Returns the obstacles of a registered map, or `None` if the name is not registered."""
    return GRID_STR_REGISTRY[name].get_obstacles() if name is not None and in_registry(name) else None
