"""The arrays of a `VecEnv`: their spaces, and buffers for them."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any, Optional, Union

import numpy as np
from gymnasium import spaces

from pogema_rs._encoder import Encoder, read_encoder
from pogema_rs.packed import words_per_agent

Arrays = Union[np.ndarray, dict[str, np.ndarray]]

# The bits of an observed cell, for each type of observations; "bits" packs them into words.
CELL_BITS = {"float32": 32, "uint8": 8, "bits": 1}


def read_dtype(dtype: Any) -> str:
    """Returns the name of a type of observations, given by name or as NumPy's type."""
    for name in CELL_BITS:
        if dtype == name or (name != "bits" and dtype == np.dtype(name)):
            if name == "bits" and sys.byteorder != "little":
                raise ValueError("dtype is 'bits', expected 'float32' or 'uint8' on a big-endian machine")
            return name
    raise ValueError(f"dtype is {dtype!r}, expected 'float32', 'uint8' or 'bits'")


def read_encoder_for(encoder: Union[Encoder, Mapping[str, Any]], dtype: str) -> Encoder:
    """Returns the encoder of a `VecEnv`, given as an `Encoder` or as a dict.

    Errors: TypeError or ValueError for wrong values; ValueError if the encoder has no channels, or if the type is not
    float32.
    """
    encoder = read_encoder(encoder)
    if not encoder.channels:
        raise ValueError("encoder has no channels, expected at least one")
    if dtype != "float32":
        raise ValueError(f"dtype is {dtype!r}, expected 'float32' with an encoder")
    return encoder


def observation_space(
    kind: str, dtype: str, num_agents: int, radius: int, size: tuple[int, int], encoder: Optional[Encoder]
) -> Union[spaces.Box, spaces.Dict]:
    """Returns the space of one environment's observations of a type: `default`, `POMAPF` or `MAPF`.

    `size` holds the rows and columns of the largest map.

    Errors: ValueError if `dtype` is `bits` and the type has no packed form, or if an encoder is given and the type is
    not `default`.
    """
    if encoder is not None:
        return _encoded_space(kind, num_agents, encoder)
    side = 2 * radius + 1
    if kind == "default":
        if dtype == "bits":
            return spaces.Box(0, 2**32 - 1, (num_agents, words_per_agent(radius)), np.uint32)
        return spaces.Box(0, 1, (num_agents, 3, side, side), np.dtype(dtype).type)
    if dtype == "bits":
        raise ValueError(f"dtype is 'bits', expected 'float32' or 'uint8' with observation_type {kind!r}")
    window = spaces.Box(0, 1, (num_agents, side, side), np.dtype(dtype).type)
    parts: dict[str, spaces.Space[Any]] = {
        "obstacles": window,
        "agents": window,
        "xy": _cells(num_agents, 1 - max(size), max(size) - 1),
        "target_xy": _cells(num_agents, 1 - max(size), max(size) - 1),
    }
    if kind == "MAPF":
        rows, columns = (length + 2 * radius for length in size)
        parts["global_obstacles"] = spaces.Box(0, 1, (rows, columns), np.uint8)
        # 0 only occurs as padding.
        parts["global_xy"] = _cells(num_agents, 0, radius + max(size) - 1)
        parts["global_target_xy"] = _cells(num_agents, 0, radius + max(size) - 1)
    return spaces.Dict(parts)


def _encoded_space(kind: str, num_agents: int, encoder: Encoder) -> Union[spaces.Box, spaces.Dict]:
    if kind != "default":
        raise ValueError(f"observation_type is {kind!r}, expected 'default' with an encoder")
    windows = spaces.Box(-1, 1, (num_agents, *encoder.shape), np.float32)
    if not encoder.scalars:
        return windows
    scalars = spaces.Box(-1, 1, (num_agents, 2 * len(encoder.scalars)), np.float32)
    return spaces.Dict({"windows": windows, "scalars": scalars})


def state_space(num_agents: int, size: tuple[int, int]) -> spaces.Dict:
    """Returns the space of one environment's global state."""
    return spaces.Dict(
        {
            "obstacles": spaces.Box(0, 1, size, np.uint8),
            "positions": _cells(num_agents, 0, max(size) - 1),
            "goals": _cells(num_agents, 0, max(size) - 1),
            "active": spaces.MultiBinary(num_agents),
        }
    )


def _cells(num_agents: int, low: int, high: int) -> spaces.Box:
    return spaces.Box(low, high, (num_agents, 2), np.int64)


def zeros(space: spaces.Space[Any], num_envs: int) -> Any:
    """Returns new arrays for some environments."""
    if isinstance(space, spaces.Dict):
        return {name: zeros(part, num_envs) for name, part in space.spaces.items()}
    shape: Any = space.shape
    return np.zeros((num_envs, *shape), np.bool_ if isinstance(space, spaces.MultiBinary) else space.dtype)


def of_env(arrays: Any, index: int) -> Any:
    """Returns the arrays of one environment."""
    return {name: part[index] for name, part in arrays.items()} if isinstance(arrays, dict) else arrays[index]


def per_env(rows: Any, envs: list[int], num_envs: int) -> np.ndarray:
    """Returns the rows of some environments, and None for the others, in an array like Gymnasium's `final_obs`."""
    every = np.full(num_envs, None, dtype=object)
    for index, env in enumerate(envs):
        every[env] = of_env(rows, index)
    return every


def for_engine(arrays: Any) -> Any:
    """Returns the arrays as the engine writes them: packed observations as words of 64 bits."""
    is_packed = isinstance(arrays, np.ndarray) and arrays.dtype == np.uint32
    return arrays.view(np.uint64) if is_packed else arrays


def check_out(out: Any, like: Any, name: str = "out") -> Any:
    """Returns a caller's buffer for observations, after checking that its arrays match those of `like`.

    Errors: TypeError for anything but arrays of the same types, ValueError for a wrong shape or layout, or for a
    read-only array.
    """
    if isinstance(like, dict):
        if not isinstance(out, dict) or set(out) != set(like):
            given = f"the keys {sorted(map(str, out))}" if isinstance(out, dict) else f"type {type(out).__name__}"
            raise TypeError(f"{name} has {given}, expected a dict of arrays with the keys {sorted(like)}")
        for key, part in like.items():
            check_out(out[key], part, f"{name}[{key!r}]")
        return out
    dtype, shape = like.dtype, like.shape
    if not isinstance(out, np.ndarray):
        raise TypeError(f"{name} has type {type(out).__name__}, expected a numpy array of {dtype} with shape {shape}")
    if out.dtype != dtype:
        raise TypeError(f"{name} has type {out.dtype}, expected {dtype}")
    if out.shape != shape:
        raise ValueError(f"{name} has shape {out.shape}, expected {shape}")
    if not out.flags.c_contiguous or not for_engine(out).flags.aligned:
        raise ValueError(f"{name} is not contiguous in memory or not aligned, expected a C-contiguous array")
    if not out.flags.writeable:
        raise ValueError(f"{name} is read-only, expected a writeable array")
    return out
