"""Warehouses: rows of shelves between two bays."""

from __future__ import annotations

from dataclasses import astuple, dataclass

from pogema_rs import _engine
from pogema_rs.toolbox.generators.generator_utils import maps_dict_to_yaml

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
    """The sizes of shelves (`wall_*`) and of gaps, in cells, and the numbers of shelves (`walls_*`).

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
    #: Between rows of shelves, above the first row and below the last one.
    vertical_gap: int = 3


def generate_warehouse(cfg: WarehouseConfig) -> str:
    """Returns the text of a warehouse. Its free cells are `!`, so that every one can be a start and a goal.

    Errors: `AssertionError` for settings that leave no cell or make a side too long, `ValueError` for a setting out of
    range.

    Source: pogema-toolbox 0.1.1, `warehouse_generator.py`, `generate_warehouse`
    """
    return _engine.warehouse(list(astuple(cfg))).replace(".", "!")


def generate_wfi_positions(grid_str: str, bottom_gap: int, vertical_gap: int) -> tuple[_Cells, _Cells]:
    """Returns the possible starts, which are in the bays, and the possible goals, which are next to shelves.

    With a `vertical_gap` of 2, goals are only below shelves, so that agents can pass.

    Errors: `ValueError` for a `vertical_gap` below 2.

    Source: pogema-toolbox 0.1.1, `warehouse_generator.py`, `generate_wfi_positions`
    """
    return _engine.warehouse_cells(grid_str, bottom_gap, vertical_gap)


def generate_wfi_warehouse(cfg: WarehouseConfig = WarehouseConfig()) -> str:  # noqa: B008 - as in pogema-toolbox
    """Returns the text of a warehouse with possible starts (`@`) and goals (`$`) only at some cells.

    Errors: those of `generate_warehouse` and `generate_wfi_positions`.

    Source: pogema-toolbox 0.1.1, `warehouse_generator.py`, `generate_wfi_warehouse`
    """
    text = generate_warehouse(cfg)
    rows = [list(row) for row in text.split("\n")]
    starts, goals = generate_wfi_positions(text, cfg.bottom_gap, cfg.vertical_gap)
    for sign, cells in (("@", starts), ("$", goals)):
        for row, col in cells:
            rows[row][col] = sign
    return "\n".join("".join(row) for row in rows)
