"""Attributes of a module that are imported at their first use: names that another module defines, and submodules."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

_PACKAGE = __name__.partition(".")[0]


def forwarded(module: str, homes: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Returns `__getattr__` and `__dir__` of a module that also offers the names in `homes`.

    `homes` maps each name to the module that defines it, without the package's name.
    """

    def get(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        value = getattr(importlib.import_module(f"{_PACKAGE}.{homes[name]}"), name)
        vars(sys.modules[module])[name] = value
        return value

    return get, lambda: sorted({*vars(sys.modules[module]), *homes})


def modules(package: str, names: Sequence[str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Returns `__getattr__` and `__dir__` of a package that imports each of its modules `names` at its first use."""

    def get(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return importlib.import_module(f"{package}.{name}")

    return get, lambda: sorted({*vars(sys.modules[package]), *names})
