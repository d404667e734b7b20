"""Warehouses: rows of shelves between two bays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pogema_rs.toolbox.generators.generator_utils import check_sides, maps_dict_to_yaml

__all__ = [
    "WarehouseConfig",
    "generate_warehouse",
    "generate_wfi_positions",
    "generate_wfi_warehouse",
    "maps_dict_to_yaml",
]

_Cells = list[tuple[int, int]]


@dataclass
class WarehouseConfig:
    """The sizes of shelves (`wall_*`) and of the gaps between them. Units: cells.

    Source: pogema-toolbox 0.1.1, `warehouse_generator.py`, `WarehouseConfig`
    """

    wall_width: int = 5
    wall_height: int = 2
    walls_in_row: int = 5
    walls_rows: int = 5
    #: The width of each bay.
    bottom_gap: int = 5
    #: Between the shelves of a row.
    horizontal_gap: int = 1
    #: Between rows of shelves.
    vertical_gap: int = 3


def generate_warehouse(cfg: WarehouseConfig) -> str:
    """Returns the text of a warehouse, in which every free cell can be a start and a goal (`!`).

    Errors: `AssertionError` for settings that leave no cell.

    Source: pogema-toolbox 0.1.1, `warehouse_generator.py`, `generate_warehouse`
    """
    period_rows, period_cols = cfg.wall_height + cfg.vertical_gap, cfg.wall_width + cfg.horizontal_gap
    height = period_rows * cfg.walls_rows + cfg.vertical_gap
    width = 2 * cfg.bottom_gap + period_cols * cfg.walls_in_row - cfg.horizontal_gap
    check_sides(width, height)
    shelves = np.zeros((height, width), dtype=bool)
    for top in (cfg.vertical_gap + row * period_rows for row in range(cfg.walls_rows)):
        for left in (cfg.bottom_gap + col * period_cols for col in range(cfg.walls_in_row)):
            shelves[top : top + cfg.wall_height, left : left + cfg.wall_width] = True
    return "\n".join("".join("#" if is_shelf else "!" for is_shelf in row) for row in shelves)


def generate_wfi_positions(grid_str: str, bottom_gap: int, vertical_gap: int) -> tuple[_Cells, _Cells]:
    """Returns the possible starts, which are in the bays, and the possible goals, which are next to shelves.

    With a `vertical_gap` of 2, goals are only below shelves, so that agents can pass.

    Errors: `ValueError` for a `vertical_gap` of 1.

    Source: pogema-toolbox 0.1.1, `warehouse_generator.py`, `generate_wfi_positions`
    """
    if vertical_gap == 1:
        raise ValueError("`vertical_gap` is `1`, expected 2 or more: goals would block the way")
    rows = grid_str.strip().split("\n")
    height, width = len(rows), len(rows[0])
    bays = [*range(bottom_gap - 1), *range(width - bottom_gap + 1, width)]
    # Every third row stays free, so that agents can leave the bay.
    lanes = [row for row in range(1, height - 1) if row % 3]
    starts = [(row, col) for row in lanes for col in bays if rows[row][col] == "!"]
    goals = []
    for row in range(height):
        above = rows[row - 1] if row > 0 else ""
        below = rows[row + 1] if row < height - 1 and vertical_gap != 2 else ""
        for col in range(width):
            if rows[row][col] == "!" and "#" in (above[col : col + 1], below[col : col + 1]):
                goals.append((row, col))
    return starts, goals


def generate_wfi_warehouse(cfg: WarehouseConfig = WarehouseConfig()) -> str:
    """Returns the text of a warehouse with possible starts (`@`) and goals (`$`) only at some cells.

    Source: pogema-toolbox 0.1.1, `warehouse_generator.py`, `generate_wfi_warehouse`
    """
    text = generate_warehouse(cfg)
    rows = [list(row) for row in text.split("\n")]
    starts, goals = generate_wfi_positions(text, cfg.bottom_gap, cfg.vertical_gap)
    for sign, cells in (("@", starts), ("$", goals)):
        for row, col in cells:
            rows[row][col] = sign
    return "\n".join("".join(row) for row in rows)
