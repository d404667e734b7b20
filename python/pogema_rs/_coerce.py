"""Coerces the values of a config as POGEMA 1.4.0 does, for example strings to numbers."""

from __future__ import annotations

import math
import numbers
from collections.abc import Mapping
from typing import Any

import numpy as np

from pogema_rs.errors import NoCellError, OutsideMapError, RejectedConfigError

_WHOLE = ("seed", "width", "height", "size", "obs_radius", "num_agents", "max_episode_steps")
_FLAGS = ("empty_outside", "persistent", "auto_reset")
_MAY_BE_NONE = (
    *("seed", "width", "height", "agents_xy", "targets_xy", "num_agents", "possible_agents_xy"),
    *("possible_targets_xy", "map", "map_name", "integration", "auto_reset"),
)
_LARGEST_COORDINATE = 65_535
_TRUE = (True, 1, "1", "on", "t", "true", "y", "yes")
_FALSE = (False, 0, "0", "off", "f", "false", "n", "no")


def coerced(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the fields with each value in a form that JSON can hold.

    Errors: `RejectedConfigError` with the field, its value and what was expected; `OutsideMapError` for starts and
    goals outside any map; `NoCellError` if the first list in `targets_xy` is empty.
    """
    result: dict[str, Any] = {}
    for name, value in fields.items():
        if value is None:
            if name not in _MAY_BE_NONE:
                raise _rejected(name, value, "a value")
            result[name] = None
        elif name in _WHOLE:
            result[name] = _whole(name, value)
        elif name in _FLAGS:
            result[name] = _flag(name, value)
        elif name == "density":
            result[name] = _number(name, value)
        elif name in ("agents_xy", "possible_agents_xy", "possible_targets_xy"):
            result[name] = _cells(name, value)
        elif name == "targets_xy":
            result[name] = _targets(name, value)
        elif name == "map":
            result[name] = _map(name, value)
        elif name == "map_name":
            value = _decoded(value)
            result[name] = value if isinstance(value, str) else str(value)
        elif isinstance(value, (str, numbers.Number, list, tuple, Mapping)):
            result[name] = value
        else:
            expected = {"MOVES": "a list", "FREE": "a number", "OBSTACLE": "a number"}.get(name, "a string")
            raise _rejected(name, value, expected)
    return result


def _rejected(name: str, value: Any, expected: str) -> RejectedConfigError:
    reason = f"`{name}` is `{_shown(value)}`, expected {expected}"
    return RejectedConfigError(f"config: {reason}", name, reason)


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _decoded(value: Any) -> Any:
    """Returns the text of bytes, and any other value as it is."""
    return value.decode(errors="replace") if isinstance(value, bytes) else value


def _whole(name: str, value: Any) -> int:
    try:
        return int(value)
    except (TypeError, ValueError, OverflowError):
        raise _rejected(name, value, "a whole number") from None


def _number(name: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if math.isfinite(number):
        return number
    raise _rejected(name, value, "a number from 0 to 1")


def _flag(name: str, value: Any) -> bool:
    key = _decoded(value)
    key = key.lower() if isinstance(key, str) else key
    if isinstance(key, (str, numbers.Number, np.bool_)):
        if key in _TRUE:
            return True
        if key in _FALSE:
            return False
    raise _rejected(name, value, "true or false")


def _listed(name: str, value: Any) -> list:
    if isinstance(value, (str, bytes, Mapping)) or not hasattr(value, "__iter__"):
        raise _rejected(name, value, "a list")
    return list(value)


def _cell(name: str, value: Any) -> Any:
    """Returns a pair of integers: a plain list as a list, any other pair as a tuple."""
    is_pair = isinstance(value, (list, tuple)) and len(value) == 2
    if not is_pair or not all(isinstance(number, numbers.Integral) for number in value):
        raise _rejected(name, value, "a pair (row, col) of whole numbers")
    cell = (list if type(value) is list else tuple)(int(number) for number in value)
    if name in ("agents_xy", "targets_xy") and not all(0 <= number <= _LARGEST_COORDINATE for number in cell):
        raise OutsideMapError(f"config: `{name}` has the cell {tuple(cell)}, expected cells inside the map")
    return cell


def _cells(name: str, value: Any) -> list:
    return [_cell(name, cell) for cell in _listed(name, value)]


def _targets(name: str, value: Any) -> list:
    goals = _listed(name, value)
    if not goals or not isinstance(goals[0], (list, tuple)):
        raise _rejected(name, value, "a list of cells, or a list of cells for each agent")
    if not goals[0]:
        raise NoCellError("config: `targets_xy` begins with an empty list, expected cells in it")
    if not isinstance(goals[0][0], (list, tuple)):
        return _cells(name, goals)
    return [_cells(name, sequence) for sequence in goals]


def _map(name: str, value: Any) -> Any:
    value = _decoded(value)
    if isinstance(value, (str, numbers.Number)):
        return value if isinstance(value, str) else str(value)
    rows = value.tolist() if hasattr(value, "tolist") else value
    return [_row(name, line, row) for line, row in enumerate(_listed(name, rows), 1)]


def _row(name: str, line: int, row: Any) -> Any:
    """Returns a row of a map; `line` is its number, from 1."""
    cells = _listed(name, row)
    for column, cell in enumerate(cells, 1):
        if not (isinstance(cell, (numbers.Number, np.bool_)) and cell in (0, 1)):
            reason = f"{name}: line {line}, column {column}: `{_shown(cell)}` is not 0 (free) or 1 (obstacle)"
            raise RejectedConfigError(reason, name, reason)
    return (tuple if isinstance(row, tuple) else list)(int(cell) for cell in cells)
