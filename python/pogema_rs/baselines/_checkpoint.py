"""Checkpoints of training runs."""

from __future__ import annotations

import hashlib
import io
from pathlib import Path
from typing import Any

import torch

from pogema_rs._files import replaced

#: The version of the format of checkpoints.
VERSION = 3
#: The size of the SHA-256 digest that ends a checkpoint. Units: bytes.
_DIGEST_SIZE = 32


def save(path: Path, values: dict[str, Any]) -> None:
    """Writes a checkpoint.

    Errors: those of `replaced`.
    """
    buffer = io.BytesIO()
    torch.save({"version": VERSION, **values}, buffer)
    content = buffer.getvalue()
    with replaced(path) as file:
        file.write(content + hashlib.sha256(content).digest())


def load(path: Path, method: str) -> dict[str, Any]:
    """Reads a checkpoint of a method.

    Errors: FileNotFoundError without a checkpoint; ValueError for another file, or for a checkpoint of another version
    or method.
    """
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no checkpoint to resume from; train without --resume")
    content = path.read_bytes()
    content, digest = content[:-_DIGEST_SIZE], content[-_DIGEST_SIZE:]
    # PyTorch reads damaged files, too.
    if hashlib.sha256(content).digest() != digest:
        raise ValueError(f"{path}: the file is not a checkpoint of a training run, or is damaged")
    values = torch.load(io.BytesIO(content), map_location="cpu", weights_only=True)
    if values["version"] != VERSION:
        raise ValueError(f"{path}: the checkpoint has version {values['version']}, expected {VERSION}")
    if values["method"] != method:
        raise ValueError(f"{path}: the checkpoint belongs to {values['method']}, expected {method}")
    return dict(values)
