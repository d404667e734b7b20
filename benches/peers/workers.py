"""Packages that are timed in separate processes, and the table of their speeds."""

import json
import statistics
import subprocess
import sys


class Worker:
    """A process that runs a script; the script times the requested work."""

    def __init__(self, python, script, *arguments):
        self.child = subprocess.Popen(
            # -P prevents the benchmark jax.py from hiding the package of the same name.
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


def summary(rounds):
    """Returns a row for each kind of work: over all rounds, the medians of both speeds and of their ratio, and all
    ratios.

    A round is a list of triples: the work, the peer's speed and ours.
    """
    table = []
    for rows in zip(*rounds):
        theirs, own = (statistics.median(row[at] for row in rows) for at in (1, 2))
        times = [row[2] / row[1] for row in rows]
        table.append({"work": rows[0][0], "peer": theirs, "ours": own, "times": statistics.median(times), "all": times})
    return table


def show(table, path):
    """Prints the rows of a summary, and writes them as JSON if a path is given."""
    if path:
        path.write_text(json.dumps(table, indent=2) + "\n")
    print(f"{'work':60}{'peer/s':>12}{'ours/s':>12}{'times':>9}")
    for row in table:
        print(f"{row['work']:60}{row['peer']:12.4g}{row['ours']:12.4g}{row['times']:9.2f}")
