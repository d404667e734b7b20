"""Runs cases on POGEMA and on the package under test at the same time."""

from __future__ import annotations

import os
import subprocess
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from compare import Comparison, Difference
from intended import IntendedDifference
from player import Described, Outcome, Package, Player
from scripts import Call, Case, case
from theirs import receive, send

HERE = Path(__file__).resolve().parent
VARIABLE = "POGEMA_ORACLE_PYTHON"


class Oracle:
    """POGEMA 1.4.0 in a separate process."""

    def __init__(self) -> None:
        python = os.environ.get(VARIABLE)
        if not python:
            raise RuntimeError(
                f"{VARIABLE} is not set: `python3.11 conformance/oracle/install.py target/oracle/venv` "
                "installs POGEMA 1.4.0 and prints the value to set"
            )
        self.process = subprocess.Popen(
            [python, str(HERE / "theirs.py")], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        self.version = receive(self.process.stdout)

    def ask(self, script: list[Call] | int) -> None:
        """Sends a script to play, or the number of a config to draw instances for; `answer` returns the result."""
        send(self.process.stdin, script)

    def answer(self) -> list[Outcome] | list[Described]:
        """Returns the answer to the oldest open request: the outcomes of a script, or the drawn instances."""
        return receive(self.process.stdout)

    def close(self) -> None:
        """Ends the process."""
        self.process.stdin.close()
        self.process.wait(timeout=30)
        self.process.stdout.close()


def ours() -> Package:
    """Returns the package under test."""
    from pogema_rs import grid_registry
    from pogema_rs.envs import _make_pogema
    from pogema_rs.grid import Grid
    from pogema_rs.grid_config import GridConfig

    return Package(GridConfig, _make_pogema, Grid, grid_registry)


@contextmanager
def oracle() -> Iterator[Oracle]:
    """Runs POGEMA 1.4.0 until the context ends."""
    pogema = Oracle()
    try:
        if pogema.version != "1.4.0":
            raise RuntimeError(f"POGEMA is {pogema.version}, expected 1.4.0")
        yield pogema
    finally:
        pogema.close()


class Run:
    """A run of cases on both packages, in order; POGEMA plays one case ahead."""

    def __init__(self, seed: int, numbers: range) -> None:
        self.seed, self.numbers = seed, numbers
        self.comparison = Comparison()
        self.kinds: Counter[str] = Counter()
        self.num_compared = 0
        self.differences: list[Difference] = []

    def play(self, max_differences: int = 5) -> None:
        """Plays cases until it finds `max_differences` differences; it still compares cases that POGEMA has begun."""
        package = ours()
        with oracle() as pogema:
            waiting: list[Case] = []
            for number in self.numbers:
                waiting.append(case(self.seed, number))
                pogema.ask(waiting[-1].script)
                if len(waiting) > 1:
                    self._compare(waiting.pop(0), pogema, package)
                if len(self.differences) >= max_differences:
                    break
            for one in waiting:
                self._compare(one, pogema, package)

    @staticmethod
    def play_intended(difference: IntendedDifference) -> Difference | None:
        """Plays an intended difference and returns how it deviates from its description, or None."""
        one = Case(0, difference.fields, list(difference.script), set(), difference.name)
        with oracle() as pogema:
            pogema.ask(one.script)
            return Comparison().compare(one, pogema.answer(), Player(ours()).play(one.script))

    def _compare(self, one: Case, pogema: Oracle, package: Package) -> None:
        self.kinds.update(one.kinds)
        self.num_compared += 1
        outcomes = Player(package).play(one.script)
        difference = self.comparison.compare(one, pogema.answer(), outcomes)
        if difference:
            self.differences.append(difference)

    def __str__(self) -> str:
        counts = self.comparison
        return (
            f"{self.num_compared} of {len(self.numbers)} cases with seed {self.seed}: {counts.num_calls} calls "
            f"compared, {counts.num_steps} of them steps, of which {counts.num_ends} end an episode "
            f"({counts.num_metrics} with metrics), and {counts.num_errors} errors; "
            f"{sum(counts.known.values())} intended differences"
        )
