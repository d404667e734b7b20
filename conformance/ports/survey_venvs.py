"""Creates a virtual environment for each POGEMA release of the survey: `python3.11 survey_venvs.py FOLDER`.

Prints one line for each release: the version, a tab, and the path of its Python, or `cannot be installed: ` and the
reason. `--only VERSION`, which can be repeated, creates only these environments. Complete environments are kept: the
stamp in an environment is written last and identifies what the environment was made from.

Packages are installed without dependency resolution; all dependencies are pinned here. The releases from 1.1.6 to 1.3.0
require NumPy 1.23.1 or earlier, which has no wheel for Python 3.11. NumPy 1.23.5 has wheels and draws the same
random numbers. It is the latest version that POGEMA 1.3.1 allows.
"""

from __future__ import annotations

import argparse
import fcntl
import hashlib
import subprocess
import sys
from pathlib import Path

# The prefix of the reason if a release could not be installed.
MISSING = "cannot be installed: "
COMMON = ["cloudpickle==3.1.2", "pydantic==1.9.1", "typing_extensions==4.16.0"]
GYMNASIUM = [*COMMON, "Farama-Notifications==0.0.6", "gymnasium==0.28.1", "jax-jumpy==1.0.0"]
PINS = {
    "1.4.0": [*GYMNASIUM, "numpy==1.26.4"],
    "1.3.1": [*GYMNASIUM, "numpy==1.23.5"],
    "1.3.0": [*GYMNASIUM, "numpy==1.23.5"],
    "1.2.2": [*GYMNASIUM, "numpy==1.23.5"],
    "1.1.6": [*COMMON, "gym==0.25.0", "gym-notices==0.1.0", "numpy==1.23.5"],
}
# gym is distributed only as source; these packages build it.
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
    """The reason why an environment cannot be created."""


def run(command: list[str]) -> str:
    """Runs a command; returns its output, and copies its errors to stderr.

    Errors: Failure with the last line that begins with `ERROR`; if no line does, with the last line.
    """
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    sys.stderr.write(done.stderr)
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or done.stdout.strip().splitlines() or ["no message"]
        raise Failure(next((line for line in reversed(lines) if line.startswith("ERROR")), lines[-1]))
    return done.stdout.strip()


def stamp_of(version: str) -> str:
    """Returns a hash of everything that an environment of this release is made from."""
    text = "\n".join([sys.version, version, *PINS[version], *BUILD])
    return hashlib.sha256(text.encode()).hexdigest() + "\n"


def build(folder: Path, version: str) -> None:
    """Creates an environment from scratch and tests it; writes the stamp last."""
    if folder.exists() and any(folder.iterdir()) and not (folder / "pyvenv.cfg").exists():
        raise Failure(f"{folder} is neither empty nor a virtual environment")
    run([sys.executable, "-m", "venv", "--clear", str(folder)])
    python = str(folder / "bin" / "python")
    pip = [python, "-m", "pip", "install", "--no-input", "--disable-pip-version-check", "--retries", "2", "--no-deps"]
    run([*pip, *BUILD])
    run([*pip, "--no-build-isolation", f"pogema=={version}", *PINS[version]])
    if (found := run([python, "-c", TRIAL])) != version:
        raise Failure(f"found POGEMA {found}, expected {version}")
    (folder / STAMP).write_text(stamp_of(version))


def provide(folder: Path, version: str) -> str:
    """Creates the environment of a release if needed; returns the part of its line after the version and the tab."""
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder.with_name(folder.name + ".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # a second process waits for the first
        stamp = folder / STAMP
        try:
            if not (stamp.is_file() and stamp.read_text() == stamp_of(version)):
                build(folder, version)
        except (Failure, OSError) as failure:
            return f"{MISSING}{' '.join(str(failure).split())}"
    return str(folder / "bin" / "python")


def main() -> None:
    """Checks the arguments, then creates the environments."""
    parser = argparse.ArgumentParser(description="Creates a virtual environment for each POGEMA release.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", action="append", choices=list(PINS), help="create only this release [default: all]")
    options = parser.parse_args()
    if sys.version_info[:2] != (3, 11):
        parser.error(f"found Python {sys.version_info.major}.{sys.version_info.minor}, expected 3.11")
    for version in options.only or PINS:
        print(version, provide(options.folder.absolute() / version, version), sep="\t", flush=True)


if __name__ == "__main__":
    main()
