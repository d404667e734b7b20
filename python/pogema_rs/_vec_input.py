"""What callers hand to a `VecEnv`, checked before anything is played."""

from __future__ import annotations

from enum import Enum
from typing import Any, Optional

import numpy as np

try:
    from gymnasium.vector import AutoresetMode
except ImportError:  # Gymnasium before 1.1 has no name for what it does.

    class AutoresetMode(Enum):  # type: ignore[no-redef]
        """What follows the end of an episode."""

        NEXT_STEP = "NextStep"
        SAME_STEP = "SameStep"
        DISABLED = "Disabled"


# POGEMA's seeds are below this.
_SEEDS = 2**63 - 1
_LARGEST = 2**63 - 1


def read_autoreset(mode: Any) -> AutoresetMode:
    """An autoreset mode, by itself or by name: `SAME_STEP`, `same_step` or `SameStep`."""
    for known in AutoresetMode:
        if mode is known or (isinstance(mode, str) and mode in (known.value, known.name, known.name.lower())):
            return known
    expected = ", ".join(repr(known.name.lower()) for known in AutoresetMode)
    raise ValueError(f"autoreset_mode is {mode!r}, expected one of {expected}")


def read_actions(actions: Any, shape: tuple[int, int]) -> np.ndarray:
    """Actions as an int64 array in one piece; that each is an action is checked where it is read.

    Errors: TypeError for anything but whole numbers, ValueError for another shape.
    """
    array = _as_array(actions)
    if array.dtype.kind not in "iu":
        raise TypeError(f"actions are of the type {array.dtype}, expected whole numbers 0 to 4, as of int64")
    if array.shape != shape:
        raise ValueError(f"actions have the shape {array.shape}, expected {shape}, one per environment and agent")
    if array.dtype == np.uint64:
        # Else the largest would turn negative, and the message would name another number.
        array = np.minimum(array, np.uint64(_LARGEST))
    return np.ascontiguousarray(array, dtype=np.int64)


def _as_array(actions: Any) -> np.ndarray:
    if isinstance(actions, np.ndarray):
        return actions
    if not hasattr(actions, "__array__") and hasattr(actions, "__dlpack__"):
        return np.from_dlpack(actions)
    try:
        return np.asarray(actions)
    except ValueError as error:
        raise ValueError(f"actions, expected whole numbers in the shape (envs, agents): {error}") from None


def check_out(out: Any, shape: tuple[int, ...], dtype: np.dtype) -> np.ndarray:
    """A caller's buffer for observations.

    Errors: TypeError for anything but an array of the type, ValueError for one that cannot be written whole.
    """
    if not isinstance(out, np.ndarray):
        raise TypeError(f"out is a {type(out).__name__}, expected a numpy array of {dtype} and the shape {shape}")
    if out.dtype != dtype:
        raise TypeError(f"out is of the type {out.dtype}, expected {dtype}")
    if out.shape != shape:
        raise ValueError(f"out has the shape {out.shape}, expected {shape}")
    if not out.flags.c_contiguous or not out.flags.aligned:
        raise ValueError("out is scattered in memory, expected a C-contiguous array")
    if not out.flags.writeable:
        raise ValueError("out is read-only, expected a writeable array")
    return out


def read_mask(options: Any, num_envs: int) -> Optional[list[bool]]:
    """Which environments a reset is for; none if for all."""
    if not options:
        return None
    for name in options:
        if name != "reset_mask":
            raise ValueError(f"options has `{name}`, expected `reset_mask` alone")
    mask = options["reset_mask"]
    if mask is None:
        return None
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        kind = f"an array of {mask.dtype}" if isinstance(mask, np.ndarray) else f"a {type(mask).__name__}"
        raise TypeError(f"options['reset_mask'] is {kind}, expected a numpy array of bool")
    if mask.shape != (num_envs,):
        raise ValueError(f"options['reset_mask'] has the shape {mask.shape}, expected {(num_envs,)}")
    if not mask.any():
        raise ValueError("options['reset_mask'] chooses no environment, expected at least one True")
    return mask.tolist()


def read_seed(seed: Any, num_envs: int) -> tuple[Optional[int], Optional[list[int]]]:
    """One seed for all environments, or one for each."""
    if seed is None:
        return None, None
    if isinstance(seed, (list, tuple, range)) or (isinstance(seed, np.ndarray) and seed.ndim > 0):
        if len(seed) != num_envs:
            raise ValueError(f"seed holds {len(seed)} seeds, expected {num_envs}, one per environment")
        return None, [_one_seed(f"seed[{env}]", one) for env, one in enumerate(seed)]
    return _one_seed("seed", seed), None


def _one_seed(name: str, seed: Any) -> int:
    if isinstance(seed, np.ndarray) and seed.ndim == 0:
        seed = seed[()]
    if isinstance(seed, (bool, np.bool_)) or not isinstance(seed, (int, np.integer)):
        raise TypeError(f"{name} is {seed!r}, expected a whole number")
    if not 0 <= seed < _SEEDS:
        raise ValueError(f"{name} is {seed}, expected 0 to {_SEEDS - 1}")
    return int(seed)
