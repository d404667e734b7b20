"""POGEMA's arrays in the forms of the protocol."""

from __future__ import annotations

from typing import Any

import numpy as np


def plain(cells: Any, radius: int = 0) -> list[list[int]]:
    """Cells as lists of Python's own integers, counted without the border."""
    return [[int(row) - radius, int(col) - radius] for row, col in cells]


def drawn(grid: Any) -> list[str]:
    """A grid as rows of `.` and `#`."""
    letters = np.where(grid == 0, ord("."), ord("#")).astype(np.uint8)
    return [row.tobytes().decode("ascii") for row in letters]


def windows(arrays: list[Any], shape: tuple[int, ...]) -> list[Any]:
    """Each agent's window as hexadecimal digits, or, where that would hide something, as numbers."""
    if any(array.shape != shape for array in arrays):
        return [array.tolist() for array in arrays]
    values = np.stack(arrays).reshape(len(arrays), -1)
    bits = values != 0
    if not np.array_equal(bits, values):
        return [array.tolist() for array in arrays]
    packed = np.packbits(bits, axis=1)
    text, size = packed.tobytes().hex(), 2 * packed.shape[1]
    return [text[start : start + size] for start in range(0, len(text), size)]


def observations(seen: Any, config: Any, at_reset: bool) -> Any:
    """What all agents see."""
    side = 2 * config.obs_radius + 1
    if config.observation_type == "default":
        return windows(seen, (3, side, side))
    told: dict[str, Any] = {
        name: windows([one[name] for one in seen], (side, side)) for name in ("obstacles", "agents")
    }
    is_global = config.observation_type == "MAPF"
    for name in ("xy", "target_xy", *(["global_xy", "global_target_xy"] if is_global else [])):
        told[name] = plain(one[name] for one in seen)
    if is_global and at_reset:
        told["global_obstacles"] = drawn(seen[0]["global_obstacles"])
    return told


def histories(states: Any, radius: int) -> list[Any]:
    """Each agent's states as lists, counted without the border."""

    def row(state: Any) -> list[Any]:
        places = [int(number) - radius for number in (state.x, state.y, state.tx, state.ty)]
        return [*places, state.step, bool(state.active)]

    return [[row(state) for state in each] for each in states]
