"""Imports packages that only some functions need."""

from __future__ import annotations

import importlib
from typing import Any

_ON_PYPI = {"yaml": "PyYAML"}


def import_optional(module: str, purpose: str) -> Any:
    """Imports a module of a package that may be missing. `purpose` names the caller in the error.

    Errors: `ImportError` with `purpose` and the command that installs the package.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as missing:
        package = module.partition(".")[0]
        if missing.name != package:
            raise
        raise ImportError(f"{purpose} needs `pip install {_ON_PYPI.get(package, package)}`", name=package) from None
