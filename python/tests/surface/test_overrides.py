"""Tests overridden methods: if POGEMA 1.4.0 or pogema-toolbox 0.1.1 calls one, pogema_rs calls it or raises an error.

`POGEMA_ORACLE_PYTHON` names the interpreter with POGEMA, and `POGEMA_TOOLBOX_FOLDER` the folder with pogema-toolbox and
its imports.
"""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from user_code import SCENARIOS
from test_behaviour import difference

HERE = Path(__file__).resolve().parent
# Classes that cannot be used without a subclass.
WITHOUT_SCENARIO = ["pogema.envs.PogemaBase", "pogema.wrappers.metrics.AbstractMetric"]
STAND_INS = HERE.parent / "toolbox" / "stand_ins"


def printed(python: str, script: str, package: str, given: str = "") -> bytes:
    """Returns what a script prints about a package."""
    folders = (os.environ["POGEMA_TOOLBOX_FOLDER"], str(STAND_INS))
    command = [python, "-B", str(HERE / script), package, *folders]
    run = subprocess.run(command, input=given.encode(), capture_output=True, timeout=600, check=False)
    assert run.returncode == 0, run.stderr.decode()
    return run.stdout


@pytest.fixture(scope="module")
def both() -> tuple[dict[str, str], dict[str, str]]:
    """The outcomes of POGEMA and ours."""
    theirs = json.loads(printed(os.environ["POGEMA_ORACLE_PYTHON"], "overrides.py", "pogema"))
    return theirs, json.loads(printed(sys.executable, "overrides.py", "pogema_rs", json.dumps(theirs)))


@pytest.fixture(scope="module")
def results() -> tuple[dict[str, Any], dict[str, Any]]:
    """The results of POGEMA and of pogema_rs with overridden methods."""
    theirs = pickle.loads(printed(os.environ["POGEMA_ORACLE_PYTHON"], "user_code.py", "pogema"))
    return theirs, pickle.loads(printed(sys.executable, "user_code.py", "pogema_rs"))


@pytest.mark.parametrize("name", SCENARIOS)
def test_overridden_methods_change_the_results_alike(name: str, results: tuple[dict[str, Any], dict[str, Any]]) -> None:
    theirs, ours = results
    assert difference(theirs[name], ours[name]) is None


def test_script_overrides_the_same_methods_in_both_packages(both: tuple[dict[str, str], dict[str, str]]) -> None:
    theirs, ours = both
    assert ours.keys() == {name for name, outcome in theirs.items() if outcome != "no scenario"}
    assert set(theirs.values()) == {"called", "not called", "no scenario"}
    called = [name for name, outcome in theirs.items() if outcome == "called"]
    assert len(called) >= 80
    assert {"pogema.envs.Pogema._obs", "pogema.a_star_policy.AStarAgent.clear_state"} <= set(called)


def test_an_overridden_method_is_called_or_rejected(both: tuple[dict[str, str], dict[str, str]]) -> None:
    theirs, ours = both
    silent = {
        name: ours[name]
        for name, outcome in theirs.items()
        if outcome == "called" and ours[name] not in ("called", "OverrideError")
    }
    assert silent == {}
    rejected = [name for name, outcome in ours.items() if outcome == "OverrideError" and theirs[name] == "called"]
    assert len(rejected) < 25, rejected


def test_every_class_with_methods_has_a_scenario(both: tuple[dict[str, str], dict[str, str]]) -> None:
    theirs, _ = both
    assert [name for name, outcome in theirs.items() if outcome == "no scenario"] == WITHOUT_SCENARIO
