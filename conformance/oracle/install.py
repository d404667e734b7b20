"""Creates the oracle's virtual environment: `python3.11 install.py DIR` prints the path of its Python as the last line.

Builds nothing if DIR is complete, that is, if it has a Python and its stamp holds the hash of requirements.txt. The
hash is written last, so a run after an interruption starts from scratch. A lock file next to DIR makes a second process
wait for the first. If the first is killed, the second also waits for the children of the first, which inherit the lock.
"""

from __future__ import annotations  # so that an older Python reaches the version check

import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

REQUIREMENTS = Path(__file__).resolve().parent / "requirements.txt"
STAMP = "oracle.stamp"
INCOMPLETE = "incomplete\n"


def fail(message: str) -> None:
    """Ends the program with one line on stderr and exit code 1."""
    sys.exit(f"install.py: {message}")


def expected_stamp() -> str:
    """Returns the stamp of a complete environment."""
    return hashlib.sha256(REQUIREMENTS.read_bytes()).hexdigest() + "\n"


def write_stamp(directory: Path, text: str) -> None:
    """Replaces the stamp atomically, so that no reader sees a partial stamp."""
    fresh = directory / f"{STAMP}.new"
    fresh.write_text(text)
    os.replace(fresh, directory / STAMP)


def is_complete(directory: Path) -> bool:
    """Returns whether the stamp matches the requirements and the interpreter exists."""
    stamp = directory / STAMP
    return stamp.is_file() and stamp.read_text() == expected_stamp() and (directory / "bin" / "python").exists()


def run(command: list[str], error: str) -> None:
    """Runs a command with its output on stderr; if it fails, ends the program with `error`."""
    code = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=sys.stderr, close_fds=False).returncode
    if code != 0:
        fail(f"{error} (exit code {code})")


def clear(directory: Path) -> None:
    """Empties the directory; fails if it contains anything other than a virtual environment."""
    if directory.exists() and not directory.is_dir():
        fail(f"{directory} is not a directory")
    directory.mkdir(parents=True, exist_ok=True)
    is_environment = (directory / STAMP).exists() or (directory / "pyvenv.cfg").exists()
    if any(directory.iterdir()) and not is_environment:
        fail(f"{directory} is not empty and not a virtual environment; remove it or choose another")
    write_stamp(directory, INCOMPLETE)
    for entry in directory.iterdir():
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        elif entry.name != STAMP:
            entry.unlink()


def build(directory: Path) -> None:
    """Creates the environment from scratch; writes the stamp of a complete environment last."""
    clear(directory)
    run([sys.executable, "-m", "venv", str(directory)], "cannot create a virtual environment; is `venv` installed?")
    pip = [str(directory / "bin" / "python"), "-m", "pip", "install", "--no-input", "--disable-pip-version-check"]
    run(
        [*pip, "--retries", "2", "--no-deps", "-r", str(REQUIREMENTS)],
        "pip cannot install requirements.txt; is the network up?",
    )
    write_stamp(directory, expected_stamp())


def main(arguments: list[str]) -> None:
    """Checks the arguments, takes the lock, builds if needed, and prints the path of the interpreter."""
    if len(arguments) != 1:
        fail("usage: python3.11 install.py DIR")
    if sys.version_info[:2] != (3, 11):
        fail(f"found Python {sys.version_info.major}.{sys.version_info.minor}, expected 3.11")
    directory = Path(arguments[0]).absolute()
    try:
        directory.parent.mkdir(parents=True, exist_ok=True)
        with open(directory.with_name(directory.name + ".lock"), "w") as lock:
            os.set_inheritable(lock.fileno(), True)
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not is_complete(directory):
                build(directory)
    except OSError as error:
        fail(str(error))
    print(directory / "bin" / "python")


if __name__ == "__main__":
    main(sys.argv[1:])
