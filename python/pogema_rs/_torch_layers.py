"""Converts PyTorch modules to layers and arrays."""

from __future__ import annotations

import contextlib
import copy
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Optional

import numpy as np
import torch
from torch import nn

from pogema_rs._encoder import Encoder

if TYPE_CHECKING:
    from pogema_rs._policy import Policy

#: Largest allowed difference of a logit, relative to the largest absolute logit or to 1, whichever is larger.
_TOLERANCE = 1e-4
_NUM_ROWS = 8
#: Layers that do nothing in evaluation mode.
_NO_OPS = (nn.Identity, nn.Dropout, nn.Dropout2d)


@dataclass
class Parts:
    """The parts of a module, and the layers and arrays that describe it."""

    body: nn.Module
    policy: nn.Linear
    scalars: Optional[nn.Module] = None
    core: Optional[nn.Module] = None
    actions: str = "policy"
    value: Optional[str] = None
    layers: list[Any] = field(default_factory=list)
    tensors: dict[str, np.ndarray] = field(default_factory=dict)

    def logits(self, windows: Any, scalars: Any) -> Any:
        """Returns the logits that the layers of the parts compute, each by its own `forward`."""
        features = _run(self.body, windows)
        if scalars is not None:
            beside = scalars if self.scalars is None else _run(self.scalars, scalars)
            features = torch.cat([features, beside], dim=1)
        return self.policy(features if self.core is None else _run(self.core, features))


def parts_of(module: Any, encoder: Encoder) -> Parts:
    """Returns the layers and arrays of a module.

    Errors: TypeError for a module or layer that cannot be exported.
    """
    if _is_sequential(module):
        parts = _of_sequential(module)
    elif isinstance(module, nn.Module) and hasattr(module, "body") and hasattr(module, "policy"):
        parts = Parts(
            body=module.body,
            policy=_linear("policy", module.policy),
            scalars=getattr(module, "scalars", None),
            core=getattr(module, "core", None),
        )
        if getattr(module, "value", None) is not None:
            parts.value = "value"
            _add_weights(parts, "value", _linear("value", module.value))
    else:
        kind = type(module).__name__
        raise TypeError(f"module has type {kind}, expected an nn.Sequential, or a module with `body` and `policy`")
    prefix = "" if _is_sequential(module) else "body"
    parts.layers += _layers(parts, prefix, parts.body)
    if encoder.scalars:
        parts.layers.append({"scalars": [] if parts.scalars is None else _layers(parts, "scalars", parts.scalars)})
    if parts.core is not None:
        parts.layers += _layers(parts, "core", parts.core)
    _add_weights(parts, parts.actions, parts.policy)
    return parts


def in_single_precision(module: Any) -> Any:
    """Returns the module, or a copy in float32 if a parameter is in half precision, because files hold float32."""
    halves = (torch.float16, torch.bfloat16)
    if isinstance(module, nn.Module) and any(one.dtype in halves for one in module.parameters()):
        return copy.deepcopy(module).float()
    return module


def compare(module: nn.Module, parts: Parts, policy: Policy, encoder: Encoder) -> None:
    """Checks that a policy returns the same logits as the parts and as the module's `forward`, for random inputs.

    A `forward` that takes other inputs or returns something else is not checked.

    Errors: ValueError if they differ, for example because a residual block returns something else.
    """
    rng = np.random.default_rng(0)
    windows = rng.uniform(-1, 1, (_NUM_ROWS, *encoder.shape)).astype(np.float32)
    scalars = None
    if encoder.scalars:
        scalars = rng.uniform(-1, 1, (_NUM_ROWS, 2 * len(encoder.scalars))).astype(np.float32)
    ours = policy.logits(windows, scalars)
    with _evaluating(module), torch.no_grad():
        like = parts.policy.weight
        inputs = [None if array is None else torch.from_numpy(array).to(like) for array in (windows, scalars)]
        of_parts = _array(parts.logits(*inputs))
        of_module = _forward(module, [values for values in inputs if values is not None], of_parts.shape[1])
    _check_same(ours, of_parts, "the written network differs from the module")
    if of_module is not None:
        names = "`body`, `scalars`, `core` and `policy`"
        _check_same(of_module, of_parts, f"the module's `forward` differs from its layers {names}")


def _check_same(ours: np.ndarray, theirs: np.ndarray, what: str) -> None:
    largest = np.abs(ours - theirs).max()
    limit = _TOLERANCE * max(1.0, float(np.abs(theirs).max()))
    if not largest <= limit:
        raise ValueError(f"{what}: logits differ by up to {largest:.3g}, expected at most {limit:.3g}")


def _forward(module: nn.Module, inputs: list[Any], num_logits: int) -> Optional[np.ndarray]:
    """Returns the logits of the module's own `forward`; None if it does not map these inputs to logits."""
    rows = []
    # A recurrent module may read rows as steps, so each call has one row.
    for row in range(_NUM_ROWS):
        # Nothing is known about a `forward`, so it may fail in any way.
        with contextlib.suppress(Exception):
            outputs = module(*[values[row : row + 1].clone() for values in inputs])
            logits = outputs[0] if isinstance(outputs, (tuple, list)) else outputs
            rows.append(_array(logits).reshape(1, num_logits))
    return np.concatenate(rows) if len(rows) == _NUM_ROWS else None


@contextmanager
def _evaluating(module: nn.Module) -> Iterator[None]:
    """Sets the module to evaluation mode, and afterwards restores the mode of each of its parts."""
    were_training = [(one, one.training) for one in module.modules()]
    module.eval()
    try:
        yield
    finally:
        for one, was_training in were_training:
            one.training = was_training


def write_onnx(module: Any, encoder: Encoder, path: str) -> None:
    """Writes a module with `torch.onnx.export`."""
    if not isinstance(module, nn.Module):
        raise TypeError(f"module has type {type(module).__name__}, expected an nn.Module")
    parameter = next(module.parameters(), torch.zeros(1))
    names, inputs = ["windows"], [torch.zeros(1, *encoder.shape).to(parameter)]
    if encoder.scalars:
        names.append("scalars")
        inputs.append(torch.zeros(1, 2 * len(encoder.scalars)).to(parameter))
    with _evaluating(module):
        with torch.no_grad():
            outputs = module(*inputs)
        has_value = isinstance(outputs, (tuple, list)) and len(outputs) > 1
        shown = ["logits", "value"] if has_value else ["logits"]
        axes = {name: {0: "batch"} for name in [*names, *shown]}
        torch.onnx.export(
            module, tuple(inputs), path, input_names=names, output_names=shown, dynamic_axes=axes, dynamo=False
        )


def _is_sequential(layer: Any) -> bool:
    """Returns whether a layer runs its children in order: an `nn.Sequential` without a `forward` of its own."""
    return isinstance(layer, nn.Sequential) and type(layer).forward is nn.Sequential.forward


def _children(layer: nn.Sequential) -> list[tuple[str, nn.Module]]:
    """Returns the children with their names; `named_children` leaves out repeated ones."""
    return [(name, child) for name, child in layer._modules.items() if child is not None]


def _of_sequential(module: nn.Sequential) -> Parts:
    children = _children(module)
    if not children:
        raise TypeError("module is an empty nn.Sequential, expected one that ends in an nn.Linear")
    name, last = children[-1]
    return Parts(body=nn.Sequential(OrderedDict(children[:-1])), policy=_linear(name, last), actions=name)


def _linear(name: str, layer: Any) -> nn.Linear:
    if not isinstance(layer, nn.Linear):
        expected = "an nn.Linear, whose outputs are the logits or the value"
        raise TypeError(f"`{name}` has type {type(layer).__name__}, expected {expected}")
    return layer


def _layers(parts: Parts, name: str, layer: Any) -> list[Any]:
    """Returns the entries of a layer in the JSON file, and adds its arrays."""
    if _is_sequential(layer):
        prefix = f"{name}." if name else ""
        return [entry for key, child in _children(layer) for entry in _layers(parts, prefix + key, child)]
    if isinstance(layer, _NO_OPS):
        return []
    if isinstance(layer, nn.Conv2d):
        padding = _padding(name, layer)
        _add_weights(parts, name, layer)
        return [{"convolution": {"name": name, "padding": padding}}]
    if isinstance(layer, nn.Linear):
        _add_weights(parts, name, layer)
        return [{"dense": name}]
    if isinstance(layer, nn.ReLU):
        return ["relu"]
    if isinstance(layer, nn.ELU) and layer.alpha == 1:
        return ["elu"]
    if isinstance(layer, nn.Flatten) and (layer.start_dim, layer.end_dim) == (1, -1):
        return ["flatten"]
    if isinstance(layer, nn.GRU) and layer.num_layers == 1 and not layer.bidirectional:
        return [_gru(parts, name, layer)]
    if hasattr(layer, "residual"):
        return _residual(parts, name, layer.residual)
    raise TypeError(f"layer `{name}` cannot be exported: {layer}".splitlines()[0])


def _residual(parts: Parts, name: str, residual: Any) -> list[Any]:
    entries = _layers(parts, f"{name}.residual", residual)
    # An in-place activation changes the input of the block before the block adds it.
    if _changes_input(residual):
        return [entries[0], {"residual": entries[1:]}]
    return [{"residual": entries}]


def _changes_input(layer: Any) -> bool:
    """Returns whether the first layer that does something works in place."""
    effective = _effective(layer)
    if not effective:
        return False
    inner = getattr(effective[0], "residual", None)
    return bool(getattr(effective[0], "inplace", False)) if inner is None else _changes_input(inner)


def _effective(layer: Any) -> list[Any]:
    """Returns the layers inside of a layer, without those that do nothing."""
    if _is_sequential(layer):
        return [one for child in layer for one in _effective(child)]
    return [] if isinstance(layer, _NO_OPS) else [layer]


_CONVOLUTION = "stride, dilation and groups of 1, and the same zero padding on all sides"


def _padding(name: str, layer: nn.Conv2d) -> int:
    rows, columns = layer.kernel_size
    padding = layer.padding
    if padding == "valid":
        padding = (0, 0)
    elif padding == "same" and rows % 2 == columns % 2 == 1:
        padding = (rows // 2, columns // 2)
    is_plain = layer.stride == (1, 1) and layer.dilation == (1, 1) and layer.groups == 1
    if not is_plain or layer.padding_mode != "zeros" or isinstance(padding, str) or padding[0] != padding[1]:
        raise TypeError(f"layer `{name}` cannot be exported: {layer}; expected {_CONVOLUTION}")
    return int(padding[0])


def _gru(parts: Parts, name: str, layer: nn.GRU) -> Any:
    for kind in ("ih", "hh"):
        weight = getattr(layer, f"weight_{kind}_l0")
        bias = getattr(layer, f"bias_{kind}_l0", None)
        parts.tensors[f"{name}.weight_{kind}_l0"] = _array(weight)
        parts.tensors[f"{name}.bias_{kind}_l0"] = np.zeros(len(weight), np.float32) if bias is None else _array(bias)
    return {"gru": name}


def _add_weights(parts: Parts, name: str, layer: Any) -> None:
    parts.tensors[f"{name}.weight"] = _array(layer.weight)
    bias = layer.bias
    parts.tensors[f"{name}.bias"] = np.zeros(len(layer.weight), np.float32) if bias is None else _array(bias)


def _array(tensor: Any) -> np.ndarray:
    array: np.ndarray = tensor.detach().float().cpu().numpy()
    return array


def _run(layer: Any, values: Any) -> Any:
    """Runs a layer on a batch; a GRU begins with a state of zeros."""
    if _is_sequential(layer):
        for child in layer:
            values = _run(child, values)
        return values
    if isinstance(layer, nn.GRU):
        steps = values.unsqueeze(1) if layer.batch_first else values.unsqueeze(0)
        return layer(steps)[1][0]
    # An in-place layer would change the caller's values.
    return layer(values.clone())
