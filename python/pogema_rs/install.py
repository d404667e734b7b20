"""Redirects `import pogema` to this package, for code that cannot be edited."""

from __future__ import annotations

import importlib
import sys
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, Optional

import gymnasium

__all__ = ["install_as_pogema", "is_installed"]

_OURS = __name__.partition(".")[0]
_THEIRS = "pogema"


class _Alias(MetaPathFinder, Loader):
    """Finds POGEMA's modules in this package, under the same names."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Optional[ModuleSpec]:
        if name.partition(".")[0] != _THEIRS:
            return None
        try:
            module = importlib.import_module(_OURS + name[len(_THEIRS) :])
        except ModuleNotFoundError as missing:
            if (missing.name or "").startswith(_OURS):
                return None
            raise
        return ModuleSpec(name, self, is_package=hasattr(module, "__path__"))

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = importlib.import_module(_OURS + spec.name[len(_THEIRS) :])
        self._spec = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        # The module has already run, and keeps its name.
        module.__spec__ = self._spec


def install_as_pogema() -> None:
    """Redirects imports of `pogema` and its modules to this package in the running process.

    Environments then rewrite the actions of a step under `soft` as POGEMA does.

    Gymnasium's wrappers again forward unknown attributes to the inner environment, as they did before release 1.0.
    Code for POGEMA 1.4.0 relies on this.

    Errors: `RuntimeError` if POGEMA itself is already imported.
    """
    imported = sys.modules.get(_THEIRS)
    if imported is not None and imported is not sys.modules[_OURS]:
        raise RuntimeError("pogema is already imported, expected a call of install_as_pogema() before the import")
    if not is_installed():
        sys.meta_path.insert(0, _Alias())
    if not hasattr(gymnasium.Wrapper, "__getattr__"):
        setattr(gymnasium.Wrapper, "__getattr__", _forward)


def is_installed() -> bool:
    """Returns whether imports of `pogema` are redirected to this package."""
    return any(isinstance(finder, _Alias) for finder in sys.meta_path)


def _forward(self: gymnasium.Wrapper, name: str) -> Any:
    if name.startswith("_"):
        raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
    return getattr(self.env, name)
