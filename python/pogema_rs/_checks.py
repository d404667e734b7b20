"""Checks of arguments that several modules share."""

from __future__ import annotations

import operator
from typing import Any, Optional, Union

import numpy as np

from pogema_rs.semantics import Semantics

# The largest radius of windows, as in the engine.
LARGEST_RADIUS = 128


def check_whole(name: str, value: Any, least: int = 1, most: Optional[int] = None, meaning: str = "") -> int:
    """Returns an argument that is a whole number, possibly of a type of NumPy, as an `int`.

    `meaning` is added to the error for a number that is out of range.

    Errors: TypeError for any other type; ValueError for a number below `least` or above `most`.
    """
    try:
        # NumPy's arrays of one number would pass, too.
        number = None if isinstance(value, (bool, np.bool_, np.ndarray)) else operator.index(value)
    except TypeError:
        number = None
    if number is None:
        raise TypeError(f"{name} is {value!r}, expected a whole number")
    if number < least or (most is not None and number > most):
        expected = f"at least {least}" if most is None else f"{least} to {most}"
        raise ValueError(f"{name} is {number}, expected {expected}{meaning}")
    return number


def check_cells(name: str, cells: Any, num_axes: int) -> np.ndarray:
    """Returns cells as an array, and rejects fractions, which the engine would drop.

    Errors: ValueError for another number of axes, and for fractions and other values that are not whole numbers.
    """
    array = np.asarray(cells)
    if array.ndim != num_axes:
        found = f"{array.ndim} axis" if array.ndim == 1 else f"{array.ndim} axes"
        raise ValueError(f"{name} has {found}, expected {num_axes}, the last for row and column")
    is_whole = array.dtype.kind in "iu" or array.size == 0
    if array.dtype.kind == "f":
        is_whole = bool((np.isfinite(array) & (array == np.trunc(array))).all())
    if not is_whole:
        raise ValueError(f"{name} holds a value that is not a whole number, expected whole numbers")
    return array


def check_semantics(semantics: Union[str, Semantics]) -> Semantics:
    """Returns a release line of POGEMA that is given by its number.

    Errors: ValueError for an unknown one.
    """
    known = [line.value for line in Semantics]
    if semantics not in known:
        raise ValueError(f"semantics is {semantics!r}, expected {' or '.join(map(repr, known))}")
    return Semantics(semantics)
