"""Tests that the unmodified pogema-toolbox gets the same results from POGEMA 1.4.0 and from pogema_rs."""

import json
import os
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parent / "evaluate.py"


def results(python, package):
    run = subprocess.run(
        [python, "-B", str(SCRIPT), package, os.environ["POGEMA_TOOLBOX_FOLDER"]],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


def test_astar_agent_has_equal_results():
    theirs = results(os.environ["POGEMA_ORACLE_PYTHON"], "pogema")
    ours = results(sys.executable, "pogema_rs")
    assert len(theirs) == 120
    assert len({json.dumps(result["metrics"]) for result in theirs}) > 60
    assert ours == theirs
