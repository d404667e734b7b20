"""Functions for PyTorch, which this module imports."""

from __future__ import annotations

from typing import Any, Optional

try:
    import torch
except ImportError as missing:
    raise ImportError("pogema_rs.torch needs `pip install torch`") from missing

from pogema_rs import packed as _packed

__all__ = ["unpack"]


def unpack(packed: torch.Tensor, radius: int, dtype: Any = None, out: Optional[torch.Tensor] = None) -> torch.Tensor:
    """Returns packed observations as windows, computed on the device of the tensor: `pogema_rs.unpack` for tensors.

    Shape: `(..., words)`, uint32 or int32, becomes `(..., 3, side, side)`, where words is `words_per_agent(radius)` and
    side is `2 * radius + 1`

    Errors: TypeError for another type, ValueError for another shape.
    """
    if not isinstance(packed, torch.Tensor):
        raise TypeError(f"packed has type {type(packed).__name__}, expected a torch tensor")
    windows: torch.Tensor = _packed.unpack(packed, radius, dtype, out)
    return windows
