"""Compares the time that pogema_rs.toolbox and pogema-toolbox 0.1.1 need to evaluate a Python policy, in one run.

python3.11 benches/peers/toolbox.py [--rounds N] [--seeds N]

Install the package with `python/run`, and set POGEMA_ORACLE_PYTHON to a Python that has POGEMA. Only the time outside
the policy counts. The peers take turns, and the ratio is the median over the rounds.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
FOLDER = HERE.parent.parent / "target/python"


def outside(python, package, seeds, *folder):
    """Returns the seconds that an evaluation takes outside the policy."""
    command = [python, "-B", HERE / "toolbox_worker.py", package, str(seeds), *folder]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    total, policy = json.loads(done.stdout)
    return total - policy


def main():
    """Prints the seconds of both toolboxes, and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seeds", type=int, default=4)
    arguments = parser.parse_args()
    pogema = os.environ.get("POGEMA_ORACLE_PYTHON") or sys.exit("toolbox: POGEMA_ORACLE_PYTHON is not set")
    rounds = []
    for _ in range(arguments.rounds):
        theirs = outside(pogema, "pogema_toolbox", arguments.seeds, FOLDER / "toolbox")
        ours = outside(FOLDER / "new/bin/python", "pogema_rs.toolbox", arguments.seeds)
        rounds.append((theirs, ours, ours / theirs))
    theirs, ours, share = (statistics.median(column) for column in zip(*rounds))
    print(f"time outside the policy: pogema-toolbox {theirs:.2f} s, pogema_rs {ours:.3f} s, ratio {share:.1%}")


main()
