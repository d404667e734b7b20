"""Expands the `grid_search` entries of a config."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

__all__ = ["generate_variants"]

_Path = tuple[str, ...]


def generate_variants(spec: Mapping[str, Any]) -> Iterator[tuple[dict[_Path, Any], dict[str, Any]]]:
    """Yields each combination of the values under `grid_search`: the chosen values by path, and the whole config.

    The value of the last entry changes fastest.

    Errors: `TypeError` for an entry without a list.

    Source: pogema-toolbox 0.1.1, `config_variant_generator.py`, `generate_variants`
    """
    varied = dict(_varied(spec, ()))
    for path, values in varied.items():
        if isinstance(values, (str, Mapping)) or not hasattr(values, "__iter__"):
            raise TypeError(f"`{'.'.join(map(str, path))}.grid_search` is `{values!r}`, expected a list of values")
    for combination in product(*varied.values()):
        changes = dict(zip(varied, combination))
        yield changes, _changed(copy.deepcopy(dict(spec)), changes)


def _varied(spec: Mapping[str, Any], above: _Path) -> Iterator[tuple[_Path, Any]]:
    for key, value in spec.items():
        if isinstance(value, Mapping):
            if "grid_search" in value:
                yield (*above, key), value["grid_search"]
            else:
                yield from _varied(value, (*above, key))


def _changed(spec: dict[str, Any], changes: Mapping[_Path, Any]) -> dict[str, Any]:
    for path, value in changes.items():
        inner = spec
        for key in path[:-1]:
            inner = inner[key]
        inner[path[-1]] = value
    return spec
