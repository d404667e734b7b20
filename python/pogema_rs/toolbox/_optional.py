"""Imports packages that only some functions of the toolbox need."""

from __future__ import annotations

import importlib
from typing import Any

_ON_PYPI = {"yaml": "PyYAML"}


def required(module: str, purpose: str) -> Any:
    """Returns a module of a package that may be missing.

    Errors: `ImportError` with the command that installs the package, and what needs it.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as missing:
        package = module.partition(".")[0]
        if missing.name != package:
            raise
        raise ImportError(f"{purpose} needs `pip install {_ON_PYPI.get(package, package)}`", name=package) from None
