"""Tests that Ctrl-C ends long calls, and that these calls leave all state unchanged.

Each case runs in its own process, which sends SIGINT to itself during a call that would take minutes, or at least
seconds.
"""

import ast
import subprocess
import sys
from pathlib import Path

import pogema_rs
import pytest
from interrupts import CASES, ENDED_FIRST, SHORT

SCRIPT = Path(__file__).parent / "interrupts.py"
STUB = Path(pogema_rs.__file__).parent / "_engine.pyi"
# Each of these takes 8 to 15 seconds.
SLOW = {"batch_dense_rewards", "batch_encoders", "batch_reset", "batch_step", "process_pool"}


def entries(body, prefix=""):
    """Yields the functions, methods and attributes that a part of the stub declares."""
    for node in body:
        if isinstance(node, ast.FunctionDef):
            yield prefix + node.name
        elif isinstance(node, ast.ClassDef):
            yield from entries(node.body, f"{node.name}.")
        elif isinstance(node, ast.AnnAssign) and prefix:
            yield prefix + node.target.id


def test_each_compiled_entry_is_interrupted_or_short():
    interrupted = {entry for _, of_case in CASES.values() for entry in of_case}
    short = [entry for group in SHORT.values() for entry in group]
    assert len(short) == len(set(short)), "an entry has two reasons"
    assert not interrupted & set(short)
    assert interrupted | set(short) == set(entries(ast.parse(STUB.read_text(encoding="utf-8")).body))


@pytest.mark.parametrize("case", [pytest.param(case, marks=pytest.mark.slow if case in SLOW else ()) for case in CASES])
def test_interrupt_ends_the_call_and_keeps_the_state(case, tmp_path):
    # On a fast machine, some calls end before the first delay.
    for attempt, scale in enumerate(("1", "0.5", "0.2", "0.08", "0.03")):
        folder = tmp_path / str(attempt)
        folder.mkdir()
        command = [sys.executable, "-B", str(SCRIPT), case, scale]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)
        if done.returncode != ENDED_FIRST:
            break
    assert done.returncode == 0, done.stdout + done.stderr
    assert {line.split(": ")[0] for line in done.stdout.splitlines() if "KeyboardInterrupt" in line} == set(
        CASES[case][1]
    )
