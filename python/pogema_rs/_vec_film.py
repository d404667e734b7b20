"""Films: pictures of every N-th episode of one environment of a `VecEnv`."""

from __future__ import annotations

import os
import tempfile
import warnings
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any, Optional, Union

from pogema_rs._checks import check_whole

if TYPE_CHECKING:
    from pogema_rs._engine import Batch

_FORMATS = ("svg", "html", "mp4")


@dataclass(frozen=True)
class Film:
    """The settings of `VecEnv(film=...)`, which films every N-th episode of one environment, each in a file of its own.

    `every` is N: the episodes 0, N, 2N, ... of the environment since it was made are filmed. `env` is the index of the
    environment. `format` is `svg` for an animated picture, `html` for a page that replays the episode, or `mp4` for a
    video, which requires the program ffmpeg. The files are `folder/{name_prefix}-episode-{number}.{format}`, like those
    of Gymnasium's `RecordVideo`.
    """

    folder: Union[str, PathLike[str]]
    every: int = 1
    env: int = 0
    format: str = "svg"
    name_prefix: str = "pogema"


class Films:
    """The films of a batch, which draws them on a thread of its own."""

    def __init__(self, batch: Batch, film: Any, num_envs: int) -> None:
        """Makes the folder, and films from the next reset on.

        Errors: TypeError or ValueError for wrong values; OSError if no file can be written to the folder, or if ffmpeg
        is missing for a video.
        """
        _check(film, num_envs)
        folder = os.path.abspath(os.fspath(film.folder))
        os.makedirs(folder, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
        path = os.path.join(folder, f"{film.name_prefix}-episode-")
        batch.film(int(film.env), min(int(film.every), 2**63), path, film.format)
        self._batch = batch
        self._finished: Optional[list[str]] = None

    def paths(self) -> list[str]:
        """Returns the paths of the films that are complete."""
        if self._finished is None:
            return [str(path) for path in self._batch.films()]
        return list(self._finished)

    def warn(self) -> None:
        """Warns about films that are missing; training continues without them."""
        # The caller of `VecEnv.step` or `VecEnv.reset`.
        _warn(self._batch.take_film_failures(), 4)

    def finish(self) -> None:
        """Ends the current film, and waits until all are complete."""
        paths, failures = self._batch.finish_films()
        self._finished = [str(path) for path in paths]
        # The caller of `VecEnv.close`, which calls this through `weakref.finalize`.
        _warn(failures, 5)


def _warn(failures: list[str], stacklevel: int) -> None:
    for reason in failures:
        warnings.warn(reason, RuntimeWarning, stacklevel=stacklevel)


def _check(film: Any, num_envs: int) -> None:
    if not isinstance(film, Film):
        raise TypeError(f"film has type {type(film).__name__}, expected a Film")
    check_whole("every", film.every)
    check_whole("env", film.env, 0, num_envs - 1, ", the index of the filmed environment")
    if film.format not in _FORMATS:
        raise ValueError(f"format is {film.format!r}, expected one of {', '.join(map(repr, _FORMATS))}")
    prefix = film.name_prefix
    if not isinstance(prefix, str) or os.path.basename(prefix) != prefix or "\0" in prefix:
        raise ValueError(f"name_prefix is {prefix!r}, expected the beginning of a file name")
