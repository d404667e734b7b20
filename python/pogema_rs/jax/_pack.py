"""Packs maps with their borders into rows of bits, on the host."""

from __future__ import annotations

from typing import Any, Optional

import numpy as np

from pogema_rs.jax._config import Config

Array = np.ndarray[Any, np.dtype[Any]]


def pack_grids(config: Config, maps: Array, noise: Optional[Array]) -> Array:
    """Returns maps of one size with their borders as rows of bits.

    The first column is the lowest bit of the first word. Everything beyond the border of a smaller map is free, and no
    agent sees it.

    Shape: `(num, height, width)` becomes `(num, config.grid[0], config.words)`, uint32

    Rule: border/ring, border/outside, border/noise
    """
    num, height, width = maps.shape
    radius = config.radius
    cells = np.zeros((num, config.grid[0], 32 * config.words), dtype=np.uint8)
    if noise is not None:
        cells[:, : height + 2 * radius, : width + 2 * radius] = noise
    cells[:, radius - 1 : radius + height + 1, radius - 1 : radius + width + 1] = 1
    cells[:, radius : radius + height, radius : radius + width] = maps
    return np.packbits(cells, axis=-1, bitorder="little").view("<u4").astype(np.uint32)
