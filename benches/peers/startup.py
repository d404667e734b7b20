"""Compares the start-up time of the Python package with that of POGEMA 1.4.0, in one run on one machine.

python3.11 benches/peers/startup.py [--rounds N] [--python PATH]

Install the package with `python/run`, and set POGEMA_ORACLE_PYTHON to a Python that has POGEMA. Each measurement is the
processor time of a new process, without the time that Python itself needs. The peers take turns. Each round gives
one ratio, and the table shows the median of these ratios. `equal releases` is this package in POGEMA's Python, with the
releases of pydantic, Gymnasium and NumPy that POGEMA requires. The row of the dependencies imports neither package.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
WORK = {
    "import of their dependencies": "import gymnasium, numpy, pydantic; type('Config', (pydantic.BaseModel,), {{}})",
    "import": "import {package}",
    "import of what an environment needs": "from {package} import GridConfig, pogema_v0",
    "import, one environment, a reset": "from {package} import GridConfig, pogema_v0; pogema_v0(GridConfig()).reset()",
}


def seconds(python, code, path=""):
    """Returns the processor time of a process that runs a statement."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    # A user's Python keeps the compiled modules.
    others = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    subprocess.run([python, "-c", code], check=True, env={**others, "PYTHONPATH": path})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def package_folder(python):
    """Returns the folder of the installed package."""
    code = "import pogema_rs; print(pogema_rs.__file__)"
    return Path(subprocess.check_output([python, "-c", code], text=True).strip()).parent


def main():
    """Prints the milliseconds of each peer, and the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--python", default=ROOT / "target/python/new/bin/python", help="a Python with the package")
    arguments = parser.parse_args()
    pogema = os.environ.get("POGEMA_ORACLE_PYTHON") or sys.exit("startup: POGEMA_ORACLE_PYTHON is not set")
    with tempfile.TemporaryDirectory() as alone:
        (Path(alone) / "pogema_rs").symlink_to(package_folder(arguments.python))
        peers = [(pogema, "pogema", ""), (arguments.python, "pogema_rs", ""), (pogema, "pogema_rs", alone)]
        print(f"{'work':38}{'POGEMA ms':>11}{'ours ms':>9}{'ratio':>7}{'equal releases ms':>19}{'ratio':>7}")
        for name, code in WORK.items():
            rounds = []
            for turn in range(arguments.rounds + 1):
                bare = [seconds(python, "pass") for python, _, _ in peers]
                rows = [seconds(python, code.format(package=package), path) for python, package, path in peers]
                if turn:  # the first round writes the compiled modules
                    rounds.append([row - without for row, without in zip(rows, bare)])
            theirs, ours, equal = (1000 * statistics.median(column) for column in zip(*rounds))
            ratios = (statistics.median(row[at] / row[0] for row in rounds) for at in (1, 2))
            print(
                "{:38}{:11.0f}{:9.0f}{:7.2f}{:19.0f}{:7.2f}".format(
                    name, theirs, ours, next(ratios), equal, next(ratios)
                )
            )


main()
