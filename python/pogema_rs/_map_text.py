"""Reads map texts for `GridConfig.str_map_to_list` and `RegisteredGrid`; environments read them in the engine."""

from __future__ import annotations

from pogema_rs._counted import counted
from pogema_rs.errors import MapShapeError, MapTextError

Cell = tuple[int, int]

LETTERS = "abcdefghijklmnopqrstuvwxyz"
SIGNS = ".#" + LETTERS + LETTERS.upper()
#: Signs of cells for starts only, for goals only, and for neither.
POOL_SIGNS = "@$!"


def read(text: str, signs: str) -> tuple[list[str], dict[str, list[Cell]]]:
    """Returns the rows of a map text, and the cells of each sign, row by row.

    Errors: `MapTextError`, a `KeyError`, for a character that is not in `signs`; `MapShapeError`, an `AssertionError`,
    for rows of unequal length.

    Rule: grid/text
    """
    rows = text.split()
    cells: dict[str, list[Cell]] = {}
    for row, line in enumerate(rows):
        for col, sign in enumerate(line):
            if sign not in signs:
                raise MapTextError(f"the map has {sign!r} in row {row}, expected one of {signs}")
            cells.setdefault(sign, []).append((row, col))
        if len(line) != len(rows[0]):
            found = counted(len(line), "cell")
            raise MapShapeError(f"row {row} of the map has {found}, expected {len(rows[0])} as in row 0")
    return rows, cells


def lettered(cells: dict[str, list[Cell]], letters: str) -> list[list[int]]:
    """Returns the last cell of each letter, in the order of `letters`.

    Rule: grid/letters
    """
    return [list(cells[letter][-1]) for letter in letters if letter in cells]
