"""Writes networks for play in Rust: from descriptions of layers and NumPy arrays, or from PyTorch modules."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Optional, Union

import numpy as np

from pogema_rs import _engine
from pogema_rs._encoder import Encoder, read_encoder
from pogema_rs._files import replaced
from pogema_rs._policy import load

_Path = Union[str, "os.PathLike[str]"]
_Encoder = Union[Encoder, Mapping[str, Any]]


def save(
    path: _Path,
    encoder: _Encoder,
    layers: Sequence[Any],
    tensors: Mapping[str, Any],
    *,
    actions: str = "policy",
    value: Optional[str] = None,
    sampling: str = "softmax",
    mask_actions: bool = False,
    name: str = "network",
) -> None:
    """Writes a network as a `.safetensors` file and the JSON file beside it.

    `layers` are those of the JSON file, as strings, dicts and lists. `tensors` are arrays by tensor name: a layer named
    `first` uses `first.weight` and `first.bias`. docs/reference/network.md lists the names for each type of layer.
    `actions` and `value` name the dense layers that return the logits and the value. `sampling` is the rule that
    chooses an action: `softmax`, `greedy` or `follower`. With `mask_actions`, no agent moves into an obstacle. `name`
    is the policy in `LEARNED` that plays the network. The network of `lswitcher` returns two values instead of logits,
    and uses neither `sampling` nor `mask_actions`.

    Errors: TypeError or ValueError for a wrong layer or tensor, which the message names, or an encoder that does not
    fit; OSError if a file cannot be written. After an error, the files are unchanged.
    """
    encoder, target = read_encoder(encoder), _target(path, ".safetensors")
    if encoder.scalars and not any(isinstance(layer, dict) and "scalars" in layer for layer in layers):
        raise ValueError("layers ignore the scalars of the encoder, expected a layer `scalars`")
    architecture: dict[str, Any] = {
        "window": list(encoder.shape),
        "scalars": 2 * len(encoder.scalars),
        "layers": list(layers),
        "actions": actions,
    }
    if value is not None:
        architecture["value"] = value
    arrays = [(name, np.ascontiguousarray(array, dtype=np.float32)) for name, array in tensors.items()]
    config = _config(encoder, sampling, mask_actions, architecture=architecture)
    _engine.write_network(target, json.dumps(config), name, arrays)


def export(
    module: Any,
    encoder: _Encoder,
    path: _Path,
    *,
    sampling: str = "softmax",
    mask_actions: bool = False,
    name: str = "network",
) -> None:
    """Writes a PyTorch module, so that it plays in Rust: as `.safetensors` or `.onnx`, with a JSON file beside it.

    `encoder` describes the module's input. `sampling` is the rule that chooses an action: `softmax`, `greedy` or
    `follower`. With `mask_actions`, no agent moves into an obstacle. `name` is the policy in `LEARNED` that plays the
    network.

    For `.safetensors`, the module is an `nn.Sequential` that ends in the `nn.Linear` of the logits, or has these
    attributes: `body`, the layers that read the windows; `policy`, the `nn.Linear` of the logits; optionally `value`,
    the `nn.Linear` of the value, `scalars`, layers of the scalars, and `core`, layers after `body` and `scalars`.
    Layers are `Conv2d` with stride, dilation and groups of 1 and the same zero padding on all sides, `Linear`, `ReLU`,
    `ELU` with `alpha` 1, `Flatten` of all axes but the first, `GRU` of one layer and one direction, `Sequential` of
    these, and residual blocks: any module that has an attribute `residual` and returns `x + self.residual(x)`.
    `Dropout` and `Identity` do nothing. The function compares the logits of the written network with those that these
    layers compute. If the module's own `forward` maps windows, and scalars if the encoder has any, to logits, the
    function compares the logits of `forward`, too.

    For `.onnx`, `torch.onnx.export` writes a module that maps windows, and scalars if the encoder has any, to logits or
    to logits and values. The graph may contain only the operators that docs/reference/network.md lists; Tanh and
    LayerNorm, for example, are not among them.

    Errors: TypeError for a layer that cannot be exported, which the message names; ValueError for an unsupported
    operator in an ONNX graph, which the message names, for shapes that do not fit the encoder, for parameters that are
    not finite, and if the logits differ; OSError if a file cannot be written. After an error, the files are unchanged.
    """
    encoder, is_onnx = read_encoder(encoder), os.fspath(path).endswith(".onnx")
    target = _target(path, ".onnx" if is_onnx else ".safetensors")
    config = _config(encoder, sampling, mask_actions)
    from pogema_rs import _torch_layers

    module = _torch_layers.in_single_precision(module)
    if is_onnx:
        _export_onnx(module, target, encoder, config, name)
        return
    parts = _torch_layers.parts_of(module, encoder)
    names: dict[str, Any] = {"actions": parts.actions, "value": parts.value}

    def write(path: _Path) -> None:
        rules: dict[str, Any] = {"sampling": sampling, "mask_actions": mask_actions, "name": name}
        save(path, encoder, parts.layers, parts.tensors, **names, **rules)

    with tempfile.TemporaryDirectory() as folder:
        trial = Path(folder) / "trial.safetensors"
        write(trial)
        _torch_layers.compare(module, parts, load(trial, name=name), encoder)
    write(target)


def _export_onnx(module: Any, target: str, encoder: Encoder, config: dict[str, Any], name: str) -> None:
    from pogema_rs import _torch_layers

    text = (json.dumps(config, indent=2) + "\n").encode()
    with tempfile.TemporaryDirectory() as folder:
        trial = Path(folder) / "trial.onnx"
        _torch_layers.write_onnx(module, encoder, str(trial))
        trial.with_suffix(".json").write_bytes(text)
        try:
            load(trial, name=name)
        except ValueError as error:
            # The folder of the trial is gone when the message is read.
            raise ValueError(str(error).replace(str(trial), target)) from None
        with replaced(Path(target)) as network, replaced(Path(target).with_suffix(".json")) as description:
            network.write(trial.read_bytes())
            description.write(text)


def _config(encoder: Encoder, sampling: str, mask_actions: bool, **other: Any) -> dict[str, Any]:
    if sampling not in _engine.WORDS["sampling"]:
        expected = ", ".join(map(repr, _engine.WORDS["sampling"]))
        raise ValueError(f"sampling is {sampling!r}, expected one of {expected}")
    rule = {"rule": sampling, "mask_actions": bool(mask_actions)}
    return {"version": 1, **other, "encoder": encoder.to_dict(), "sampling": rule}


def _target(path: _Path, suffix: str) -> str:
    name = os.fspath(path)
    if not name.endswith(suffix):
        raise ValueError(f"path is {name!r}, expected the name of a file that ends in {suffix}")
    return name
