"""Compares the speed of a training loop on `VecEnv` with the same loop on POGEMA 1.4.0 and on arrays that never change.

Also compares it with the loops of Sample Factory and TorchRL on POGEMA 1.4.0.

python3.11 benches/peers/training.py [--rounds N] [--seconds S] [--bf16] [--json FILE]

The loop is that of python/examples/train_ppo.py with 64 environments of 16 agents. POGEMA plays in Gymnasium's
AsyncVectorEnv, one process for each environment; the frameworks get two processes. All take turns. Each round gives one
ratio for each loop, and the table shows the medians over the rounds. With --bf16, the network of the loop computes in
bfloat16, but not those of the frameworks. Installs PyTorch, the frameworks, POGEMA and the wheel in a folder under
target/.
"""

import argparse
import subprocess
import sys
from pathlib import Path

from workers import Worker, show, summary

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
# The required speed of `ours`, as a multiple of the peer's speed.
BARS = {"free": 0.93, "pogema": 2.5}
NAMES = {
    "free": "an environment that costs nothing",
    "pogema": "POGEMA 1.4.0 in AsyncVectorEnv",
    "sample_factory": "Sample Factory on POGEMA 1.4.0",
    "torchrl": "TorchRL on POGEMA 1.4.0",
}
FRAMEWORKS = ("sample_factory", "torchrl")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--bf16", action="store_true")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    python = subprocess.check_output([ROOT / "python/venv", "training_peers", HERE / "training.txt"], text=True).strip()
    options = ["--bf16"] if arguments.bf16 else []
    loops = Worker(python, HERE / "training_worker.py", *options)
    frameworks = Worker(python, HERE / "training_frameworks.py")
    workers = {name: frameworks if name in FRAMEWORKS else loops for name in ("ours", *NAMES)}
    rounds = []
    for number in range(arguments.rounds):
        speeds = {name: worker.time(name, arguments.seconds) for name, worker in workers.items()}
        print(f"round {number + 1}: {speeds}", file=sys.stderr)
        rounds.append([(f"agent steps, {title}", speeds[name], speeds["ours"]) for name, title in NAMES.items()])
    table = [{**row, "bar": BARS.get(name)} for name, row in zip(NAMES, summary(rounds))]
    show(table, arguments.json)


main()
