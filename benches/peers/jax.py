"""Compares the speed of `pogema_rs.jax` with POGEMA 1.4.0 and with VecEnv, in one run on one machine.

python3.11 benches/peers/jax.py [--rounds N] [--environments N] [--json FILE]

JAX_PYTHON names a Python with JAX and the released wheel. POGEMA_ORACLE_PYTHON names a Python with POGEMA. All rates
except that of compilations are steps per second of one environment with 32 x 32 cells, 64 agents, radius 5 and `soft`.
POGEMA runs in one process. The peers take turns. Each round gives one ratio, and the table shows the median of these
ratios.
"""

import argparse
import os
import sys
from pathlib import Path

from workers import Worker, show, summary

HERE = Path(__file__).resolve().parent
NUM_AGENTS = 64
# A step and its observation must compile within this time. Units: seconds.
COMPILE_BAR = 3.0


def measure(pogema, rust, compiled, num_envs):
    """Returns the rows of one round: name, the peer's rate, ours."""
    peer = pogema.time("step", NUM_AGENTS)
    batch = {
        dtype: num_envs * rust.time("vector", num_envs, NUM_AGENTS, os.cpu_count(), dtype)
        for dtype in ("float32", "uint8", "bits")
    }
    ours = {view: num_envs * compiled.time("steps", num_envs, NUM_AGENTS, view) for view in ("f32", "u8", "rows", None)}
    return [
        ("f32 windows, against POGEMA", peer, ours["f32"]),
        ("u8 windows, against POGEMA", peer, ours["u8"]),
        ("packed rows, against POGEMA", peer, ours["rows"]),
        ("f32 windows, against VecEnv", batch["float32"], ours["f32"]),
        ("u8 windows, against VecEnv", batch["uint8"], ours["u8"]),
        ("packed rows, against VecEnv with bits", batch["bits"], ours["rows"]),
        ("step alone, against VecEnv with f32", batch["float32"], ours[None]),
        (
            f"compilations, against {COMPILE_BAR:.0f} s each",
            1 / COMPILE_BAR,
            compiled.time("compile", num_envs, NUM_AGENTS),
        ),
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--environments", type=int, default=512)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    python = os.environ.get("JAX_PYTHON") or sys.exit("jax: JAX_PYTHON is not set")
    oracle = os.environ.get("POGEMA_ORACLE_PYTHON") or sys.exit("jax: POGEMA_ORACLE_PYTHON is not set")
    pogema = Worker(oracle, HERE / "worker.py", "pogema")
    rust = Worker(python, HERE / "worker.py", "pogema_rs")
    compiled = Worker(python, HERE / "jax_worker.py")
    rounds = [measure(pogema, rust, compiled, arguments.environments) for _ in range(arguments.rounds)]
    show(summary(rounds), arguments.json)


main()
