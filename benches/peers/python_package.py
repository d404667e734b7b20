"""Compares the speed of the Python package with POGEMA 1.4.0 and with the Rust batch, in one run on one machine.

python3.11 benches/peers/python_package.py [--rounds N] [--json FILE]

Build the program (`cargo build --release`), install the package with `python/run`, and set POGEMA_ORACLE_PYTHON to a
Python that has POGEMA. The peers take turns. Each round gives one ratio, and the table shows the median.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

from workers import Worker, show, summary

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
WORKER = HERE / "worker.py"
OURS = ROOT / "target/python/new/bin/python"
PROGRAM = ROOT / "target/release/pogema"
BATCH = "64 lanes of 64 agents"
# The minimum agent steps per second that a trainer needs, with windows of obstacles, costs to go and agents.
ENCODED_BAR = 5e6
# Rows whose speed of writing observations is compared with that of writing zeros.
WRITTEN = ["16 lanes of 64 agents", "64 lanes of 64 agents", "256 lanes of 64 agents", "10000 agents, 256 x 256"]


def rust_rows(part):
    """Returns the rows of `pogema bench` whose names contain `part`."""
    table = ROOT / "target/python/batch.json"
    command = [PROGRAM, "bench", "--rows", part, "--seconds", "0.3", "--json", table]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return json.loads(table.read_text())["rows"]


def rust_batch():
    """Returns the steps per second of the whole Rust batch, with observations."""
    (row,) = rust_rows(BATCH)
    return row["speed"]["step_f32"] / 64 / 64


def against_zeros(part):
    """Yields rows that compare two speeds: filling observation buffers with zeros, and writing observations as f32."""
    for row in rust_rows(part):
        yield f"zeros, {row['name']}", row["speed"]["fill_f32"], row["speed"]["f32"]


def measure(peer, ours):
    """Returns the rows of one round: name, the peer's speed, our speed. Both are per second and for the same work."""
    step_64 = peer.time("step", 64)
    return [
        ("step, 64 agents", step_64, ours.time("step", 64)),
        ("step, 1 agent", peer.time("step", 1), ours.time("step", 1)),
        ("reset with a new seed, 64 agents", peer.time("reset", 64), ours.time("reset", 64)),
        ("VecEnv of 64, 64 agents, 2 threads", step_64, 64 * ours.time("vector", 64, 64, 2)),
        ("the same, packed into bits", step_64, 64 * ours.time("vector", 64, 64, 2, "bits")),
        (
            "new goals and episodes, against the Rust batch",
            rust_batch(),
            ours.time("vector", 64, 64, 2, "float32", True),
        ),
        ("agent steps with an encoder, against 5 million", ENCODED_BAR, 64 * 64 * ours.time("encoded", 64, 64, 2)),
        *(row for part in WRITTEN for row in against_zeros(part)),
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    pogema = os.environ.get("POGEMA_ORACLE_PYTHON") or sys.exit("python_package: POGEMA_ORACLE_PYTHON is not set")
    peer, ours = Worker(pogema, WORKER, "pogema"), Worker(OURS, WORKER, "pogema_rs")
    rounds = [measure(peer, ours) for _ in range(arguments.rounds)]
    show(summary(rounds), arguments.json)


main()
