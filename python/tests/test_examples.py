"""Tests the examples that need no framework, in short runs; `./check frameworks` and `./check jax` run the others."""

import subprocess
import sys

import pytest
from example_files import EXAMPLES, WITH_FRAMEWORK

SHORT = {
    "custom_reward.py": ([], "step 5: rewards"),
    "evaluate_policy.py": (["--seeds", "3"], "A*       ISR"),
    "imitation_data.py": (["--episodes", "8"], "steps of 8 agents"),
    "replay_html.py": (["--out", "page.html"], "'CSR': 1.0"),
}


def test_all_examples_are_listed():
    assert {path.name for path in EXAMPLES.glob("*.py")} == {*SHORT, *WITH_FRAMEWORK}


@pytest.mark.parametrize("name", SHORT)
def test_example_runs(name, tmp_path):
    arguments, shown = SHORT[name]
    command = [sys.executable, "-B", str(EXAMPLES / name), *arguments]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert shown in run.stdout
