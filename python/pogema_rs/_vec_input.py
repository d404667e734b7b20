"""Checks the arguments of a `VecEnv` before it plays."""

from __future__ import annotations

from enum import Enum
from typing import Any, Optional

import numpy as np

from pogema_rs._checks import check_whole
from pogema_rs._counted import counted

try:
    from gymnasium.vector import AutoresetMode
except ImportError:  # Gymnasium before 1.1 does not define the modes.

    class AutoresetMode(Enum):  # type: ignore[no-redef]
        """How the next episode of an environment begins."""

        NEXT_STEP = "NextStep"
        SAME_STEP = "SameStep"
        DISABLED = "Disabled"


# Upper bound of POGEMA's seeds, exclusive.
_SEEDS = 2**63 - 1
_LARGEST = 2**63 - 1


def read_autoreset(mode: Any) -> AutoresetMode:
    """Returns an autoreset mode, given as a mode or by name: `SAME_STEP`, `same_step` or `SameStep`."""
    for known in AutoresetMode:
        if mode is known or (isinstance(mode, str) and mode in (known.value, known.name, known.name.lower())):
            return known
    expected = ", ".join(repr(known.name.lower()) for known in AutoresetMode)
    raise ValueError(f"autoreset_mode is {mode!r}, expected one of {expected}")


def read_actions(actions: Any, shape: tuple[int, int]) -> np.ndarray:
    """Returns actions as a contiguous int64 array; the engine checks the range of each number.

    Errors: TypeError for anything but integers, ValueError for another shape.
    """
    array = _as_array(actions)
    if array.dtype.kind not in "iu":
        raise TypeError(f"actions have type {array.dtype}, expected whole numbers 0 to 4, for example int64")
    if array.shape != shape:
        raise ValueError(f"actions have shape {array.shape}, expected {shape}, one per environment and agent")
    if array.dtype == np.uint64:
        # Otherwise large numbers would become negative, also in the message.
        array = np.minimum(array, np.uint64(_LARGEST))
    return np.require(array, np.int64, ["C_CONTIGUOUS", "ALIGNED"])


def _as_array(actions: Any) -> np.ndarray:
    if isinstance(actions, np.ndarray):
        return actions
    if not hasattr(actions, "__array__") and hasattr(actions, "__dlpack__"):
        return np.from_dlpack(actions)
    try:
        return np.asarray(actions)
    except ValueError as error:
        reason = f"actions are not an array, expected whole numbers in the shape (envs, agents): {error}"
        raise ValueError(reason) from None


def read_mask(options: Any, num_envs: int) -> Optional[list[bool]]:
    """Returns which environments to reset, or `None` for all."""
    if not options:
        return None
    for name in options:
        if name != "reset_mask":
            raise ValueError(f"options has `{name}`, expected only `reset_mask`")
    mask = options["reset_mask"]
    if mask is None:
        return None
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        kind = mask.dtype if isinstance(mask, np.ndarray) else type(mask).__name__
        raise TypeError(f"options['reset_mask'] has type {kind}, expected a numpy array of bool")
    if mask.shape != (num_envs,):
        raise ValueError(f"options['reset_mask'] has shape {mask.shape}, expected {(num_envs,)}")
    if not mask.any():
        raise ValueError("options['reset_mask'] selects no environment, expected at least one True")
    return mask.tolist()


def read_seed(seed: Any, num_envs: int) -> tuple[Optional[int], Optional[list[int]]]:
    """Returns one seed for all environments and `None`, or `None` and a list with one seed for each.

    Without a seed, both are `None`.
    """
    if seed is None:
        return None, None
    if isinstance(seed, (list, tuple, range)) or (isinstance(seed, np.ndarray) and seed.ndim > 0):
        if len(seed) != num_envs:
            found = counted(len(seed), "seed")
            raise ValueError(f"seed holds {found}, expected {num_envs}, one per environment")
        return None, [_one_seed(f"seed[{env}]", one) for env, one in enumerate(seed)]
    return _one_seed("seed", seed), None


def _one_seed(name: str, seed: Any) -> int:
    if isinstance(seed, np.ndarray) and seed.ndim == 0:
        seed = seed[()]
    return check_whole(name, seed, 0, _SEEDS - 1)
