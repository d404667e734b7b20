"""A replay buffer of whole episodes, in files that outlive a killed training run."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from pogema_rs.baselines import _record
from pogema_rs.baselines._config import TrainingConfig
from pogema_rs.baselines._record import Record


class Replay:
    """The last `capacity` episodes, as memory-mapped files, one for each array.

    The files have room for `spare` more episodes. If at most `spare` episodes are added after a checkpoint, they
    overwrite none of those that the checkpoint refers to. A checkpoint therefore stores only the number of episodes.
    """

    def __init__(
        self, folder: Path, config: TrainingConfig, map_size: tuple[int, int], sizes: tuple[int, int], count: int
    ) -> None:
        """Opens the files, or creates them if `count`, the number of episodes so far, is 0.

        Errors: FileNotFoundError if a file is missing or has the wrong size; OSError if it cannot be created.
        """
        self.capacity, spare = sizes
        self.count, self._slots = count, self.capacity + spare
        folder.mkdir(parents=True, exist_ok=True)
        self._arrays: dict[str, np.ndarray] = {}
        for name, (shape, dtype) in _record.layout(config, map_size).items():
            full = (self._slots, *shape)
            if 0 in full:
                self._arrays[name] = np.zeros(full, dtype=dtype)
                continue
            path = folder / f"{name}.bin"
            size = int(np.prod(full)) * np.dtype(dtype).itemsize
            if count and (not path.is_file() or path.stat().st_size != size):
                expected = f"expected {size:,} bytes; the run cannot resume"
                raise FileNotFoundError(f"{path}: part of the replay buffer is missing or has another size, {expected}")
            if not count:
                _create(path, size)
            self._arrays[name] = np.memmap(path, dtype, "r+", shape=full)

    def __len__(self) -> int:
        return min(self.count, self.capacity)

    def add(self, record: Record) -> None:
        """Adds the episodes of all lanes."""
        lanes = record.shape[1]
        slots = np.arange(self.count, self.count + lanes) % self._slots
        for name, array in _record.by_lane(record).items():
            self._arrays[name][slots] = array
        self.count += lanes

    def sample(self, ages: np.ndarray) -> Record:
        """Returns the episodes with the given ages: 0 is the newest, `len(self) - 1` the oldest."""
        slots = (self.count - 1 - ages) % self._slots
        return _record.by_step({name: np.asarray(array[slots]) for name, array in self._arrays.items()})

    def flush(self) -> None:
        """Writes all episodes to the disk."""
        for array in self._arrays.values():
            if isinstance(array, np.memmap):
                array.flush()


def _create(path: Path, size: int) -> None:
    """Creates a file of zeros.

    Errors: OSError if the disk has no room.
    """
    with open(path, "wb") as file:
        try:
            file.truncate(size)
            # A sparse file on a full disk would kill the process in a later write.
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, size)
        except OSError as error:
            raise OSError(error.errno, f"{error.strerror}, {size:,} bytes are needed", str(path)) from None
