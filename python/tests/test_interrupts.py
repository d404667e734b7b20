"""Tests that Ctrl-C ends long calls, which leave all state as it was.

Each case runs in its own process, which sends SIGINT to itself during a call that would take minutes, or at least seconds.
"""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parent / "interrupts.py"
CASES = [
    "animation",
    "batch_construction",
    "batch_reset",
    "batch_step",
    "built_in_evaluation",
    "long_episode",
    "page",
    "pickle",
    "planner_agents",
    "planners",
    "process_pool",
    "reset",
]


@pytest.mark.parametrize("case", CASES)
def test_interrupt_ends_the_call_and_leaves_the_state(case, tmp_path):
    command = [sys.executable, "-B", str(SCRIPT), case]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr


def test_each_case_is_tested():
    done = subprocess.run([sys.executable, "-B", str(SCRIPT)], capture_output=True, text=True, timeout=60)
    assert done.stdout.split() == CASES
