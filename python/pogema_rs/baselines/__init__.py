"""Trainers of learned methods, most of them from POGEMA's paper. The trained weights play in Rust.

    python -m pogema_rs.baselines train qmix --out runs/qmix --minutes 60

Training needs the extra `train`: `pip install 'pogema-rs[train]'`. Importing this package imports no PyTorch.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pogema_rs.baselines._config import METHODS, TrainingConfig, load_config

if TYPE_CHECKING:
    from pogema_rs.baselines._run import Budget, train  # noqa: F401 - for type checkers

# `Budget` and `train` are left out: they need PyTorch, and an import of all names must not need it.
__all__ = ["METHODS", "TrainingConfig", "load_config"]


def __getattr__(name: str) -> Any:
    if name not in ("Budget", "train"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from pogema_rs.baselines import _run

    return getattr(_run, name)
