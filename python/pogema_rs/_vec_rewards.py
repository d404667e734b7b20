"""The rewards of a `VecEnv`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Optional

import numpy as np

RewardFunction = Callable[[np.ndarray, np.ndarray, np.ndarray, dict[str, Any]], np.ndarray]

# The engine's rewards for each value of the argument `rewards`.
_NAMES = {"own": "own", "shared": "shared", "dense": "own"}


def read_rewards(rewards: Any) -> tuple[str, bool, Optional[RewardFunction]]:
    """Returns the name of the engine's rewards, whether progress to the goal is rewarded, and the caller's function."""
    if callable(rewards):
        return "own", False, rewards
    if not isinstance(rewards, str) or rewards not in _NAMES:
        raise ValueError(f"rewards is {rewards!r}, expected 'own', 'shared', 'dense' or a function")
    return _NAMES[rewards], rewards == "dense", None


def changed_rewards(change: RewardFunction, rewards: np.ndarray, *others: Any) -> np.ndarray:
    """Returns the rewards of a step as a caller's function changes them.

    Errors: TypeError for anything but an array of float32, ValueError for another shape.
    """
    changed = change(rewards, *others)
    if not isinstance(changed, np.ndarray):
        raise TypeError(
            f"the function `rewards` returned a value of type {type(changed).__name__}, expected a numpy array"
        )
    if changed.dtype != np.float32:
        raise TypeError(f"the function `rewards` returned an array of {changed.dtype}, expected float32")
    if changed.shape != rewards.shape:
        raise ValueError(f"the function `rewards` returned shape {changed.shape}, expected {rewards.shape}")
    return changed
