"""Files that a killed training leaves whole."""

from __future__ import annotations

import io
import os
import pickle
from pathlib import Path
from typing import Any

import torch

#: The format of a checkpoint.
VERSION = 1


def write(path: Path, content: bytes) -> None:
    """Replaces a file in one step, so that it holds the old or the new content, even if the machine fails.

    Errors: OSError if the file cannot be written; it then keeps its content.
    """
    part = path.with_name(path.name + ".part")
    try:
        with open(part, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except OSError:
        part.unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def save(path: Path, values: dict[str, Any]) -> None:
    """Writes a checkpoint.

    Errors: those of `write`.
    """
    buffer = io.BytesIO()
    torch.save({"version": VERSION, **values}, buffer)
    write(path, buffer.getvalue())


def load(path: Path, method: str) -> dict[str, Any]:
    """Reads a checkpoint of a method.

    Errors: FileNotFoundError without a checkpoint; ValueError for another file, or for a checkpoint
    of another method.
    """
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no checkpoint to resume from; train without --resume")
    try:
        values = torch.load(path, map_location="cpu", weights_only=True)
    except (RuntimeError, EOFError, ValueError, KeyError, pickle.UnpicklingError):
        raise ValueError(f"{path}: the file is not a checkpoint of a training") from None
    if not isinstance(values, dict) or "version" not in values or "method" not in values:
        raise ValueError(f"{path}: the file is not a checkpoint of a training")
    if values["version"] != VERSION:
        raise ValueError(f"{path}: the checkpoint has version {values['version']}, expected {VERSION}")
    if values["method"] != method:
        raise ValueError(f"{path}: the checkpoint is one of {values['method']}, expected {method}")
    return dict(values)


def _sync_folder(folder: Path) -> None:
    # Windows cannot open a folder, and needs no such call.
    if os.name == "posix":
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
