"""Packages that are timed in processes of their own."""

import json
import subprocess
import sys


class Worker:
    """A process that runs a script, which times the work that it is asked for."""

    def __init__(self, python, script, *arguments):
        self.child = subprocess.Popen(
            # -P, because the benchmark jax.py must not hide the package of this name.
            [python, "-BP", script, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def time(self, *work):
        """Returns calls per second."""
        print(json.dumps(work), file=self.child.stdin, flush=True)
        line = self.child.stdout.readline()
        if not line:
            sys.exit(f"{' '.join(map(str, self.child.args))} exited during {work}")
        return json.loads(line)


def print_table(table):
    """Prints rows of work, the peer's speed, ours, and their ratio."""
    print(f"{'work':60}{'peer/s':>12}{'ours/s':>12}{'times':>9}")
    for row in table:
        print(f"{row['work']:60}{row['peer']:12.4g}{row['ours']:12.4g}{row['times']:9.2f}")
