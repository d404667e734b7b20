"""Atomic writes: a file holds its complete old or its complete new content."""

from __future__ import annotations

import contextlib
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import IO, Union


def write_text(name: Union[str, PathLike[str]], text: str) -> None:
    """Writes a text to a file in UTF-8, and creates missing parent folders.

    Errors: OSError if the file cannot be written. After any error, an existing file keeps its content.
    """
    path = Path(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.exists() and not path.is_file():
        path.write_text(text, encoding="utf-8")  # a pipe, for example /dev/stdout, cannot be replaced
        return
    # Keep a symbolic link and replace its target.
    with replaced(path.resolve()) as file:
        file.write(text.encode())


@contextmanager
def replaced(path: Path) -> Iterator[IO[bytes]]:
    """Opens a new file that replaces `path` atomically when the block ends.

    If the machine crashes, `path` holds its complete old or its complete new content.

    Errors: OSError if the file cannot be written. After any error, `path` keeps its content.
    """
    # Another process may write the same file at the same time.
    part = path.with_name(f".pogema-unfinished-{secrets.token_hex(8)}")
    try:
        opened = open(part, "xb")
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    try:
        with opened as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    # Windows cannot open a folder, and some network drives cannot sync one. The file itself is on the disk.
    with contextlib.suppress(OSError):
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
