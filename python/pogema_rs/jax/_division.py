"""Divides whole numbers, and rounds the quotient to the nearest float32.

XLA replaces a division by a constant with a multiplication by its reciprocal, which may round differently, and an
accelerator may divide approximately. Integer arithmetic is exact everywhere.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

__all__ = ["nearest_quotient"]

NUM_BITS = 30


def nearest_quotient(numerator: jax.Array, divisor: jax.Array) -> jax.Array:
    """Returns the quotient, rounded as IEEE 754 does. Numbers are from 0 to 2**29, the divisor at least 1.

    Shape: scalars, int32; the result is float32
    """
    above, below = numerator.astype(jnp.uint32), divisor.astype(jnp.uint32)
    # Shifts the shorter number to the length of the longer one, so that the quotient is between 1/2 and 2.
    shift = jax.lax.clz(above).astype(jnp.int32) - jax.lax.clz(below).astype(jnp.int32)
    above = above << jnp.maximum(shift, 0).astype(jnp.uint32)
    below = below << jnp.maximum(-shift, 0).astype(jnp.uint32)

    def divide(_: int, carry: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        rest, quotient = carry
        bit = (rest >= below).astype(jnp.uint32)
        return (rest - bit * below) << 1, (quotient << 1) | bit

    rest, quotient = jax.lax.fori_loop(0, NUM_BITS, divide, (above, jnp.uint32(0) * above))
    # The last bit is a sticky bit: it is set if any later bit is, so that the conversion rounds correctly.
    quotient = quotient | (rest > 0).astype(jnp.uint32)
    exponent = jnp.uint32(127 - (NUM_BITS - 1)) - shift.astype(jnp.uint32)
    scale = jax.lax.bitcast_convert_type(exponent << 23, jnp.float32)
    return jnp.where(numerator == 0, jnp.float32(0), quotient.astype(jnp.float32) * scale)
