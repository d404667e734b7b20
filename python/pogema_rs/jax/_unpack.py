"""Packed observations as windows, unpacked on the device."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp

from pogema_rs._checks import LARGEST_RADIUS, check_whole
from pogema_rs.packed import words_per_agent

__all__ = ["unpack", "unpack_rows"]

# The side of the largest windows whose rows are looked up in a table, which then fits a cache of 128 KiB.
LARGEST_TABLE = 11


def unpack(packed: jax.Array, radius: int, dtype: Any = jnp.float32) -> jax.Array:
    """Returns the observations of `VecEnv(dtype="bits")` as windows, like `pogema_rs.unpack`.

    Shape: `(..., words)`, uint32, becomes `(..., 3, side, side)`, where words is `words_per_agent(radius)` and side is
    `2 * radius + 1`

    Errors: TypeError for another type, ValueError for another shape, before anything is compiled.
    """
    words, side = words_per_agent(radius), 2 * radius + 1
    packed = _check(packed, (words,), radius)
    cells = bits_of(packed, 3 * side * side)
    return cells.reshape(*packed.shape[:-1], 3, side, side).astype(dtype)


def unpack_rows(packed: jax.Array, radius: int, dtype: Any = jnp.float32) -> jax.Array:
    """Returns the rows of `observe_rows` as windows.

    Shape: `(..., side, words)`, uint32, becomes `(..., side, side)`, where words is side / 32, rounded up

    Errors: TypeError for another type, ValueError for another shape, before anything is compiled.
    """
    side = 2 * check_whole("radius", radius, 1, LARGEST_RADIUS) + 1
    packed = _check(packed, (side, -(-side // 32)), radius)
    if side <= LARGEST_TABLE:
        return jax.lax.platform_dependent(
            packed, cpu=partial(_look_up, side, dtype), default=partial(_shift, side, dtype)
        )
    if side <= 32:
        return _shift(side, dtype, packed)
    return bits_of(packed, side).astype(dtype)


def bits_of(words: jax.Array, count: int) -> jax.Array:
    """Returns the first bits of the words of the last axis, the lowest bit of each word first.

    Shape: `(..., words)`, uint32, becomes `(..., count)`
    """
    bits = (words[..., None] >> jnp.arange(32, dtype=jnp.uint32)) & 1
    return bits.reshape(*words.shape[:-1], -1)[..., :count]


def _shift(side: int, dtype: Any, packed: jax.Array) -> jax.Array:
    """Returns the bits of rows of one word."""
    return ((packed >> jnp.arange(side, dtype=jnp.uint32)) & 1).astype(dtype)


def _look_up(side: int, dtype: Any, packed: jax.Array) -> jax.Array:
    """Returns the bits of rows of one word, from a table of all rows, which is faster on a CPU."""
    table = _shift(side, dtype, jnp.arange(1 << side, dtype=jnp.uint32)[:, None])
    # Without the barrier, a CPU computes each row again for each of its bits.
    rows = jax.lax.optimization_barrier(packed[..., 0] & jnp.uint32((1 << side) - 1))
    return table.at[rows].get(mode="promise_in_bounds")


def _check(packed: jax.Array, ends: tuple[int, ...], radius: int) -> jax.Array:
    packed = jnp.asarray(packed)
    if packed.dtype != jnp.uint32:
        raise TypeError(f"packed has type {packed.dtype}, expected uint32")
    if packed.shape[-len(ends) :] != ends:
        expected = ", ".join(map(str, ends))
        raise ValueError(f"packed has shape {packed.shape}, expected (..., {expected}) at radius {radius}")
    return packed
