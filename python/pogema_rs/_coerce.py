"""Coerces the values of a config as POGEMA 1.4.0 does, which accepts for example numbers as strings."""

from __future__ import annotations

import math
import numbers
from collections.abc import Mapping
from typing import Any

from pogema_rs.errors import NoCellError, OutsideMapError, RefusedConfigError

_WHOLE = ("seed", "width", "height", "size", "obs_radius", "num_agents", "max_episode_steps")
_FLAGS = ("empty_outside", "persistent", "auto_reset")
_MAY_BE_NONE = (
    *("seed", "width", "height", "agents_xy", "targets_xy", "num_agents", "possible_agents_xy"),
    *("possible_targets_xy", "map", "map_name", "integration", "auto_reset"),
)
_LARGEST = 65_535
_TRUE = (True, 1, "1", "on", "t", "true", "y", "yes")
_FALSE = (False, 0, "0", "off", "f", "false", "n", "no")


def coerced(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the fields with each value in a form that JSON can hold.

    Errors: `RefusedConfigError` with the field, its value and what was expected; `OutsideMapError` for cells outside
    any map; `NoCellError` for an empty list of goals.
    """
    result: dict[str, Any] = {}
    for name, value in fields.items():
        if value is None:
            if name not in _MAY_BE_NONE:
                raise _refused(name, value, "a value")
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
            result[name] = value if isinstance(value, str) else str(value)
        else:
            result[name] = value
    return result


def _refused(name: str, value: Any, expected: str) -> RefusedConfigError:
    text = repr(value)
    shown = text if len(text) <= 60 else text[:57] + "..."
    reason = f"`{name}` is `{shown}`, expected {expected}"
    return RefusedConfigError(f"config: {reason}", name, reason)


def _whole(name: str, value: Any) -> int:
    try:
        return int(value)
    except (TypeError, ValueError, OverflowError):
        raise _refused(name, value, "a whole number") from None


def _number(name: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if math.isfinite(number):
        return number
    raise _refused(name, value, "a number from 0 to 1")


def _flag(name: str, value: Any) -> bool:
    key = value.lower() if isinstance(value, str) else value
    if isinstance(key, (str, numbers.Number)) or type(key).__name__ == "bool_":
        if any(key == known for known in _TRUE):
            return True
        if any(key == known for known in _FALSE):
            return False
    raise _refused(name, value, "true or false")


def _listed(name: str, value: Any) -> list:
    if isinstance(value, (str, bytes, Mapping)) or not hasattr(value, "__iter__"):
        raise _refused(name, value, "a list")
    return list(value)


def _cell(name: str, value: Any) -> Any:
    """Returns a pair of integers in the container it was given in."""
    is_pair = isinstance(value, (list, tuple)) and len(value) == 2
    if not is_pair or not all(isinstance(number, numbers.Integral) for number in value):
        raise _refused(name, value, "a pair (row, col) of whole numbers")
    if name in ("agents_xy", "targets_xy") and not all(0 <= number <= _LARGEST for number in value):
        raise OutsideMapError(f"config: `{name}` has the cell {tuple(value)}, expected cells inside the map")
    return type(value)(int(number) for number in value) if type(value) in (list, tuple) else tuple(value)


def _cells(name: str, value: Any) -> list:
    return [_cell(name, cell) for cell in _listed(name, value)]


def _targets(name: str, value: Any) -> list:
    goals = _listed(name, value)
    if not goals or not isinstance(goals[0], (list, tuple)):
        raise _refused(name, value, "a list of cells, or a list of cells for each agent")
    if not goals[0]:
        raise NoCellError("config: `targets_xy` begins with an empty list, expected cells in it")
    if not isinstance(goals[0][0], (list, tuple)):
        return _cells(name, goals)
    return [_cells(name, sequence) for sequence in goals]


def _map(name: str, value: Any) -> Any:
    if isinstance(value, (str, numbers.Number)):
        return str(value)
    rows = value.tolist() if hasattr(value, "tolist") else value
    rows = _listed(name, rows)
    if any(number not in (0, 1) for row in rows for number in _listed(name, row)):
        raise _refused(name, value, "rows of the numbers 0 and 1")
    return [(tuple if isinstance(row, tuple) else list)(int(number) for number in row) for row in rows]
