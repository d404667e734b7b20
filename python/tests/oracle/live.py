"""Both sides of the comparison, at work at the same time."""

from __future__ import annotations

import os
import subprocess
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from compare import Comparison, Difference
from player import Outcome, Package, Player
from scripts import Call, Case, case
from surprises import Surprise
from theirs import receive, send

HERE = Path(__file__).resolve().parent
VARIABLE = "POGEMA_ORACLE_PYTHON"


class Oracle:
    """POGEMA 1.4.0 in a process of its own."""

    def __init__(self) -> None:
        python = os.environ.get(VARIABLE)
        if not python:
            raise RuntimeError(
                f"{VARIABLE} is not set: `python3.11 conformance/oracle/install.py target/oracle/venv` "
                "installs POGEMA 1.4.0 and prints what it has to be"
            )
        self.process = subprocess.Popen(
            [python, str(HERE / "theirs.py")], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        self.version = receive(self.process.stdout)

    def ask(self, script: list[Call] | int) -> None:
        """Gives a script to play, or the number of a config to draw an instance of; the result comes by `answer`."""
        send(self.process.stdin, script)

    def answer(self) -> list[Outcome]:
        """The outcomes of the oldest script asked for."""
        return receive(self.process.stdout)

    def close(self) -> None:
        """Ends the process."""
        self.process.stdin.close()
        self.process.wait(timeout=30)
        self.process.stdout.close()


def ours() -> Package:
    """The package under test."""
    from pogema_rs import grid_registry
    from pogema_rs.envs import _make_pogema
    from pogema_rs.grid import Grid
    from pogema_rs.grid_config import GridConfig

    return Package(GridConfig, _make_pogema, Grid, grid_registry)


@contextmanager
def oracle() -> Iterator[Oracle]:
    """POGEMA 1.4.0, ended in the end."""
    pogema = Oracle()
    try:
        if pogema.version != "1.4.0":
            raise RuntimeError(f"POGEMA is {pogema.version}, expected 1.4.0")
        yield pogema
    finally:
        pogema.close()


class Run:
    """Cases played on both sides, one after the other, while the next one is played by POGEMA."""

    def __init__(self, seed: int, numbers: range) -> None:
        self.seed, self.numbers = seed, numbers
        self.comparison = Comparison()
        self.kinds: Counter[str] = Counter()
        self.differences: list[Difference] = []

    def play(self, most_differences: int = 5) -> None:
        """Plays all, or until so many differ."""
        package = ours()
        with oracle() as pogema:
            waiting: list[Case] = []
            for number in self.numbers:
                waiting.append(case(self.seed, number))
                pogema.ask(waiting[-1].script)
                if len(waiting) > 1:
                    self._compare(waiting.pop(0), pogema, package)
                if len(self.differences) >= most_differences:
                    break
            for one in waiting:
                self._compare(one, pogema, package)

    @staticmethod
    def surprise(surprise: Surprise) -> Difference | None:
        """What is wrong with a difference by decision."""
        one = Case(0, surprise.fields, list(surprise.script), set(), surprise.name)
        with oracle() as pogema:
            pogema.ask(one.script)
            return Comparison().compare(one, pogema.answer(), Player(ours()).play(one.script))

    def _compare(self, one: Case, pogema: Oracle, package: Package) -> None:
        self.kinds.update(one.kinds)
        outcomes = Player(package).play(one.script)
        difference = self.comparison.compare(one, pogema.answer(), outcomes)
        if difference:
            self.differences.append(difference)

    def __str__(self) -> str:
        counts = self.comparison
        return (
            f"{len(self.numbers)} cases with seed {self.seed}: {counts.num_calls} calls compared, {counts.num_steps} "
            f"of them steps, {counts.num_ends} of these the end of an episode ({counts.num_metrics} with metrics), and "
            f"{counts.num_errors} errors; {sum(counts.known.values())} differences by decision"
        )
