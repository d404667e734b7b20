"""`import pogema` made to mean this package, for code that nobody can edit."""

from __future__ import annotations

import importlib
import sys
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, Optional

import gymnasium

__all__ = ["install_as_pogema"]

_OURS = __name__.partition(".")[0]
_THEIRS = "pogema"


class _Alias(MetaPathFinder, Loader):
    """Finds POGEMA's modules here, under the same names."""

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
        # The module has run already, and keeps the name it has.
        module.__spec__ = self._spec


def install_as_pogema() -> None:
    """Makes `import pogema`, and the import of its modules, give this package in the running process.

    Gymnasium's wrappers get back what they did before its release 1.0, which code for POGEMA 1.4.0 relies on: unknown
    attributes are those of the environment inside.

    Errors: `RuntimeError` if POGEMA itself is imported already.
    """
    imported = sys.modules.get(_THEIRS)
    if imported is not None and imported is not sys.modules[_OURS]:
        raise RuntimeError("pogema is imported already, expected install_as_pogema() to be called before")
    if not any(isinstance(finder, _Alias) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Alias())
    if not hasattr(gymnasium.Wrapper, "__getattr__"):
        setattr(gymnasium.Wrapper, "__getattr__", _forward)


def _forward(self: gymnasium.Wrapper, name: str) -> Any:
    if name.startswith("_"):
        raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
    return getattr(self.env, name)
