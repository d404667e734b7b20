"""Redirects `import pogema` and `import pogema_toolbox` to this package, for code that cannot be edited."""

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
# Packages, by the names under which they can be imported.
_PACKAGES = {"pogema": _OURS, "pogema_toolbox": f"{_OURS}.toolbox"}


class _Alias(MetaPathFinder, Loader):
    """Finds the modules of another package in this one, under the same names."""

    def __init__(self, theirs: str) -> None:
        self.theirs = theirs

    def _ours(self, name: str) -> str:
        return _PACKAGES[self.theirs] + name[len(self.theirs) :]

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Optional[ModuleSpec]:
        if name.partition(".")[0] != self.theirs:
            return None
        try:
            module = importlib.import_module(self._ours(name))
        except ModuleNotFoundError as missing:
            if (missing.name or "").startswith(_OURS):
                return None
            raise
        return ModuleSpec(name, self, is_package=hasattr(module, "__path__"))

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = importlib.import_module(self._ours(spec.name))
        # Two threads may import different modules at the same time, so this finder cannot hold the spec.
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        # The module has already run, and keeps its name.
        spec = module.__spec__
        module.__spec__ = None if spec is None else spec.loader_state


def install_as_pogema(toolbox: bool = False) -> None:
    """Redirects imports of `pogema` and its modules to this package in the running process.

    Environments then rewrite the actions of a step under `soft` as POGEMA does.

    With `toolbox`, also redirects `pogema_toolbox` to `pogema_rs.toolbox`. Evaluations then write into their folder
    what pogema-toolbox writes, and environments of suites have exactly its metrics.

    Gymnasium's wrappers again forward unknown attributes to the inner environment, as they did before release 1.0.
    Code for POGEMA 1.4.0 relies on this.

    Errors: `RuntimeError` if one of these packages itself is already imported.
    """
    packages = ["pogema", "pogema_toolbox"] if toolbox else ["pogema"]
    for name in packages:
        imported = sys.modules.get(name)
        if imported is not None and imported is not sys.modules.get(_PACKAGES[name]):
            raise RuntimeError(f"{name} is already imported, expected a call of install_as_pogema() before the import")
    for name in packages:
        if not is_installed(name):
            sys.meta_path.insert(0, _Alias(name))
    if not hasattr(gymnasium.Wrapper, "__getattr__"):
        gymnasium.Wrapper.__getattr__ = _forward  # type: ignore[attr-defined]


def is_installed(package: str = "pogema") -> bool:
    """Returns whether imports of `pogema` or `pogema_toolbox` are redirected to this package."""
    return any(isinstance(finder, _Alias) and finder.theirs == package for finder in sys.meta_path)


def _forward(self: gymnasium.Wrapper, name: str) -> Any:
    if name.startswith("_"):
        raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
    return getattr(self.env, name)
