"""Observations packed into bits, as `VecEnv(dtype="bits")` returns them."""

from __future__ import annotations

import sys
from typing import Any, Optional, Union, overload

import numpy as np

from pogema_rs._checks import LARGEST_RADIUS, check_whole

__all__ = ["unpack", "words_per_agent"]


def words_per_agent(radius: int) -> int:
    """Returns the number of 32-bit words that hold the observation of one agent; the last one may be padding."""
    return 2 * -(-_num_cells(radius) // 64)


@overload
def unpack(packed: np.ndarray, radius: int, dtype: Any = None, out: Optional[np.ndarray] = None) -> np.ndarray: ...


@overload
def unpack(packed: Any, radius: int, dtype: Any = None, out: Any = None) -> Any: ...


def unpack(packed: Any, radius: int, dtype: Any = None, out: Any = None) -> Any:
    """Returns packed observations as windows: channels obstacles, agents and goal, with every value 0 or 1.

    `packed` is a NumPy array of uint32, or a Torch tensor of uint32 or int32 that shares or copies such an array. A
    tensor is unpacked on its device. `dtype` is the type of the result [default: float32]. `out` is an array or
    a tensor for the result, and its type is then the type of the result; `dtype` and `out` exclude each other.

    The bits of an agent are its channels, row after row; the first cell is the lowest bit of the first word.

    Shape: `(..., words)` becomes `(..., 3, side, side)`, where words is `words_per_agent(radius)` and side is
    `2 * radius + 1`

    Errors: TypeError for another type, ValueError for another shape.
    """
    count, side = _num_cells(radius), 2 * radius + 1
    torch: Any = sys.modules.get("torch")
    is_tensor = torch is not None and isinstance(packed, torch.Tensor)
    if not is_tensor and not isinstance(packed, np.ndarray):
        raise TypeError(f"packed has type {type(packed).__name__}, expected a numpy array of uint32 or a torch tensor")
    if str(packed.dtype) not in (("torch.uint32", "torch.int32") if is_tensor else ("uint32",)):
        expected = "torch.uint32 or torch.int32" if is_tensor else "uint32"
        raise TypeError(f"packed has type {packed.dtype}, expected {expected}")
    words = words_per_agent(radius)
    if packed.ndim == 0 or packed.shape[-1] != words:
        raise ValueError(f"packed has shape {tuple(packed.shape)}, expected (..., {words}) at radius {radius}")
    shape = (*packed.shape[:-1], 3, side, side)
    if out is not None:
        _check_out(out, type(packed) if not is_tensor else torch.Tensor, shape, dtype)
    if is_tensor:
        return _unpack_tensor(torch, packed, count, shape, dtype, out)
    values = np.unpackbits(np.ascontiguousarray(packed).view(np.uint8), axis=-1, count=count, bitorder="little")
    values = values.reshape(shape)
    if out is None:
        return values.astype(np.float32 if dtype is None else dtype, copy=False)
    # NumPy does not cast bytes to bool here, because bytes other than 0 and 1 would lose their values.
    np.copyto(out, values.view(np.bool_) if out.dtype == np.bool_ else values)
    return out


def _unpack_tensor(torch: Any, packed: Any, count: int, shape: tuple[int, ...], dtype: Any, out: Optional[Any]) -> Any:
    numbers = packed.contiguous().view(torch.uint8)
    shifts = torch.arange(8, dtype=torch.uint8, device=packed.device)
    bits = numbers.unsqueeze(-1).bitwise_right_shift(shifts).bitwise_and_(1)
    values = bits.flatten(-2)[..., :count].reshape(shape)
    if out is not None:
        return out.copy_(values)
    if dtype is None:
        dtype = torch.float32
    return values.to(dtype if isinstance(dtype, torch.dtype) else getattr(torch, np.dtype(dtype).name))


def _check_out(out: Any, kind: Any, shape: tuple[int, ...], dtype: Union[None, Any]) -> None:
    if not isinstance(out, kind):
        raise TypeError(f"out has type {type(out).__name__}, expected type {kind.__name__}, like packed")
    if tuple(out.shape) != shape:
        raise ValueError(f"out has shape {tuple(out.shape)}, expected {shape}")
    if dtype is not None:
        raise TypeError("dtype and out are both given, expected one of them")


def _num_cells(radius: int) -> int:
    return 3 * (2 * check_whole("radius", radius, 1, LARGEST_RADIUS) + 1) ** 2
