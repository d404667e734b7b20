"""Files that stay whole if a training run is killed, and checkpoints."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import torch

from pogema_rs._files import replaced

#: The version of the format of checkpoints.
VERSION = 1


def save(path: Path, values: dict[str, Any]) -> None:
    """Writes a checkpoint.

    Errors: those of `replaced`.
    """
    with replaced(path) as file:
        torch.save({"version": VERSION, **values}, file)


def load(path: Path, method: str) -> dict[str, Any]:
    """Reads a checkpoint of a method.

    Errors: FileNotFoundError without a checkpoint; ValueError for another file, or for a checkpoint of another version
    or method.
    """
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no checkpoint to resume from; train without --resume")
    try:
        # PyTorch does not compare the checksums of the file.
        with zipfile.ZipFile(path) as archive:
            is_damaged = archive.testzip() is not None
        values = torch.load(path, map_location="cpu", weights_only=True)
    except OSError:
        raise
    except Exception:  # a damaged file makes PyTorch raise almost any class
        raise ValueError(f"{path}: the file is not a checkpoint of a training") from None
    if is_damaged:
        raise ValueError(f"{path}: the checkpoint is damaged")
    if not isinstance(values, dict) or "version" not in values or "method" not in values:
        raise ValueError(f"{path}: the file is not a checkpoint of a training")
    if values["version"] != VERSION:
        raise ValueError(f"{path}: the checkpoint has version {values['version']}, expected {VERSION}")
    if values["method"] != method:
        raise ValueError(f"{path}: the checkpoint is one of {values['method']}, expected {method}")
    return dict(values)
