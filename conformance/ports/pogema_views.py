"""Converts POGEMA's arrays to the forms of the protocol."""

from __future__ import annotations

from typing import Any

import numpy as np


def cell_lists(cells: Any, radius: int = 0) -> list[list[int]]:
    """Converts cells to lists of Python integers in map coordinates."""
    return [[int(row) - radius, int(col) - radius] for row, col in cells]


def grid_rows(grid: Any) -> list[str]:
    """Converts a grid to rows of `.` and `#`."""
    letters = np.where(grid == 0, ord("."), ord("#")).astype(np.uint8)
    return [row.tobytes().decode("ascii") for row in letters]


def windows(arrays: list[Any], shape: tuple[int, ...]) -> list[Any]:
    """Encodes the window of each agent as hexadecimal digits, or as numbers if bits cannot represent it."""
    if any(array.shape != shape for array in arrays):
        return [array.tolist() for array in arrays]
    values = np.stack(arrays).reshape(len(arrays), -1)
    bits = values != 0
    if not np.array_equal(bits, values):
        return [array.tolist() for array in arrays]
    packed = np.packbits(bits, axis=1)
    text, size = packed.tobytes().hex(), 2 * packed.shape[1]
    return [text[start : start + size] for start in range(0, len(text), size)]


def observations(arrays_of_agents: Any, config: Any, at_reset: bool) -> Any:
    """Encodes the observations of all agents."""
    side = 2 * config.obs_radius + 1
    if config.observation_type == "default":
        return windows(arrays_of_agents, (3, side, side))
    record: dict[str, Any] = {
        name: windows([one[name] for one in arrays_of_agents], (side, side)) for name in ("obstacles", "agents")
    }
    is_global = config.observation_type == "MAPF"
    for name in ("xy", "target_xy", *(["global_xy", "global_target_xy"] if is_global else [])):
        record[name] = cell_lists(one[name] for one in arrays_of_agents)
    if is_global and at_reset:
        record["global_obstacles"] = grid_rows(arrays_of_agents[0]["global_obstacles"])
    return record


def histories(states: Any, radius: int) -> list[Any]:
    """Converts the states of each agent to lists, in map coordinates."""

    def row(state: Any) -> list[Any]:
        places = [int(number) - radius for number in (state.x, state.y, state.tx, state.ty)]
        return [*places, state.step, bool(state.active)]

    return [[row(state) for state in each] for each in states]
