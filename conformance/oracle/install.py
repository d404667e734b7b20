"""Makes the oracle's virtual environment: `python3.11 install.py DIR` prints the path of its python as the last line.

Does nothing when DIR is complete, that is, when its stamp holds the hash of requirements.txt. The stamp is written
last, so an interrupted run is done again from the start. A lock beside DIR makes a second process wait for the first,
and for the children of a first that was killed, which inherit it.
"""

from __future__ import annotations  # an older Python gets as far as the message that it is too old

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


def wanted_stamp() -> str:
    """The content of the stamp of a complete environment."""
    return hashlib.sha256(REQUIREMENTS.read_bytes()).hexdigest() + "\n"


def write_stamp(directory: Path, text: str) -> None:
    """Replaces the stamp in one move, so that no reader sees half of it."""
    fresh = directory / f"{STAMP}.new"
    fresh.write_text(text)
    os.replace(fresh, directory / STAMP)


def is_complete(directory: Path) -> bool:
    """Whether the stamp fits the requirements and the interpreter is still there."""
    stamp = directory / STAMP
    return stamp.is_file() and stamp.read_text() == wanted_stamp() and (directory / "bin" / "python").exists()


def run(command: list[str], otherwise: str) -> None:
    """Runs a command with its output on stderr; its failure is ours."""
    code = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=sys.stderr, close_fds=False).returncode
    if code != 0:
        fail(f"{otherwise} (exit code {code})")


def clear(directory: Path) -> None:
    """Empties the directory, or refuses if it holds something other than a virtual environment."""
    if directory.exists() and not directory.is_dir():
        fail(f"{directory} is not a directory")
    directory.mkdir(parents=True, exist_ok=True)
    ours = (directory / STAMP).exists() or (directory / "pyvenv.cfg").exists()
    if any(directory.iterdir()) and not ours:
        fail(f"{directory} is not empty and not a virtual environment; remove it or choose another")
    write_stamp(directory, INCOMPLETE)
    for entry in directory.iterdir():
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        elif entry.name != STAMP:
            entry.unlink()


def build(directory: Path) -> None:
    """Makes the environment from nothing; the stamp comes last."""
    clear(directory)
    run([sys.executable, "-m", "venv", str(directory)], "cannot make a virtual environment; is `venv` installed?")
    pip = [str(directory / "bin" / "python"), "-m", "pip", "install", "--no-input", "--disable-pip-version-check"]
    run([*pip, "--retries", "2", "--no-deps", "-r", str(REQUIREMENTS)], "pip cannot install requirements.txt; is there a network?")
    write_stamp(directory, wanted_stamp())


def main(arguments: list[str]) -> None:
    """Checks the call, takes the lock, builds if need be, prints the interpreter's path."""
    if len(arguments) != 1:
        fail("usage: python3.11 install.py DIR")
    if sys.version_info[:2] != (3, 11):
        fail(f"Python 3.11 is needed, this is {sys.version_info.major}.{sys.version_info.minor}")
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
