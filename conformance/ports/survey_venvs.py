"""Makes one virtual environment for each POGEMA release that the survey compares: `python3.11 survey_venvs.py FOLDER`.

Prints a line for each: the version, a tab, and its python, or `cannot be installed: ` and why. `--only VERSION`, which
may stand several times, makes only those. A second run does nothing where the first was done: the stamp in an
environment, written last, says what it was made from.

Packages are installed without a look at their dependencies, all of which are pinned here: the releases from 1.1.6 to
1.3.0 ask for NumPy 1.23.1 at most, of which there is no wheel for Python 3.11. NumPy 1.23.5 is the latest that 1.3.1
allows, has wheels, and draws the same random numbers.
"""

from __future__ import annotations

import argparse
import fcntl
import hashlib
import subprocess
import sys
from pathlib import Path

COMMON = ["cloudpickle==3.1.2", "pydantic==1.9.1", "typing_extensions==4.16.0"]
GYMNASIUM = [*COMMON, "Farama-Notifications==0.0.6", "gymnasium==0.28.1", "jax-jumpy==1.0.0"]
PINS = {
    "1.4.0": [*GYMNASIUM, "numpy==1.26.4"],
    "1.3.1": [*GYMNASIUM, "numpy==1.23.5"],
    "1.3.0": [*GYMNASIUM, "numpy==1.23.5"],
    "1.2.2": [*GYMNASIUM, "numpy==1.23.5"],
    "1.1.6": [*COMMON, "gym==0.25.0", "gym-notices==0.1.0", "numpy==1.23.5"],
}
# gym comes as source alone, and is built with these.
BUILD = ["setuptools==65.5.1", "wheel==0.45.1"]
STAMP = "survey.stamp"
TRIAL = """
import pogema
env = pogema.pogema_v0(pogema.GridConfig(num_agents=2, seed=0))
env.reset()
env.step([0, 0])
print(pogema.__version__)
"""


class Failure(Exception):
    """Why an environment cannot be made."""


def run(command: list[str]) -> str:
    """A command's output; what it says otherwise goes to stderr, and its last line is why it failed."""
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    sys.stderr.write(done.stderr)
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or done.stdout.strip().splitlines() or ["no message"]
        raise Failure(next((line for line in reversed(lines) if line.startswith("ERROR")), lines[-1]))
    return done.stdout.strip()


def stamp_of(version: str) -> str:
    """What an environment of this release is made from."""
    text = "\n".join([sys.version, version, *PINS[version], *BUILD])
    return hashlib.sha256(text.encode()).hexdigest() + "\n"


def build(folder: Path, version: str) -> None:
    """Makes an environment from nothing and tries it; the stamp comes last."""
    if folder.exists() and any(folder.iterdir()) and not (folder / "pyvenv.cfg").exists():
        raise Failure(f"{folder} is not empty and no virtual environment")
    run([sys.executable, "-m", "venv", "--clear", str(folder)])
    python = str(folder / "bin" / "python")
    pip = [python, "-m", "pip", "install", "--no-input", "--disable-pip-version-check", "--retries", "2", "--no-deps"]
    run([*pip, *BUILD])
    run([*pip, "--no-build-isolation", f"pogema=={version}", *PINS[version]])
    if (found := run([python, "-c", TRIAL])) != version:
        raise Failure(f"this is POGEMA {found}")
    (folder / STAMP).write_text(stamp_of(version))


def provide(folder: Path, version: str) -> str:
    """What to print of a release."""
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder.with_name(folder.name + ".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # a second process waits for the first
        stamp = folder / STAMP
        try:
            if not (stamp.is_file() and stamp.read_text() == stamp_of(version)):
                build(folder, version)
        except (Failure, OSError) as failure:
            return f"cannot be installed: {' '.join(str(failure).split())}"
    return str(folder / "bin" / "python")


def main() -> None:
    """Checks the call, then goes through the releases."""
    parser = argparse.ArgumentParser(description="Makes one virtual environment for each POGEMA release.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", action="append", choices=list(PINS), help="this release alone")
    options = parser.parse_args()
    if sys.version_info[:2] != (3, 11):
        parser.error(f"Python 3.11 is needed, this is {sys.version_info.major}.{sys.version_info.minor}")
    for version in options.only or PINS:
        print(version, provide(options.folder.absolute() / version, version), sep="\t", flush=True)


if __name__ == "__main__":
    main()
