"""Tests that this package and POGEMA 1.4.0 share a virtual environment, as docs/guide/versions.md says.

`POGEMA_ORACLE_PYTHON` names an interpreter with POGEMA 1.4.0 and the releases that it requires, and
`POGEMA_TOOLBOX_FOLDER` the folder with pogema-toolbox.
"""

import json
import os
import subprocess
import sys
from importlib.metadata import distributions, requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import pogema_rs

# A run without the tests that need POGEMA still imports this module.
ORACLE = os.environ.get("POGEMA_ORACLE_PYTHON", "POGEMA_ORACLE_PYTHON is not set")
SHARED = ("gymnasium", "numpy", "pydantic")

BOTH = """
import warnings
warnings.simplefilter("ignore")
import gymnasium
import numpy as np
import {first}
import {second}

played = []
for package in (pogema, pogema_rs):
    env = package.pogema_v0(package.GridConfig(num_agents=4, size=8, seed=1, on_target="restart"))
    observations, _ = env.reset()
    steps = [env.step([step % 5] * 4) for step in range(20)]
    played.append((np.array(observations), [[np.array(step[0]), step[1:]] for step in steps]))
assert repr(played[0]) == repr(played[1])
assert type(gymnasium.make("Pogema-v0").unwrapped).__module__ == "pogema.envs"
assert type(gymnasium.make("pogema_rs/Pogema-v0").unwrapped).__module__ == "pogema_rs.envs"
"""


def run(python, code, path):
    """Runs a program that also imports modules from a folder."""
    environment = {**os.environ, "PYTHONPATH": str(path)}
    return subprocess.run([python, "-B", "-c", code], env=environment, capture_output=True, text=True, check=False)


def requirements(texts):
    """Returns the accepted releases of each shared package."""
    found = [Requirement(text) for text in texts]
    return {one.name: one.specifier for one in found if one.name in SHARED and one.marker is None}


def test_requirements_allow_the_releases_that_pogema_needs():
    code = (
        "import json; from importlib.metadata import requires, version;"
        f"print(json.dumps([requires('pogema'), {{name: version(name) for name in {SHARED}}}]))"
    )
    of_pogema, installed = json.loads(run(ORACLE, code, "").stdout)
    (toolbox,) = distributions(name="pogema-toolbox", path=[os.environ["POGEMA_TOOLBOX_FOLDER"]])
    ours = requirements(requires("pogema-rs"))
    assert set(ours) == set(SHARED)
    for specifiers in (ours, requirements(of_pogema), requirements(toolbox.requires)):
        assert all(specifier.contains(installed[name]) for name, specifier in specifiers.items()), specifiers


@pytest.mark.slow
def test_pip_resolves_pogema_toolbox_beside_the_wheel(tmp_path):
    report = tmp_path / "report.json"
    # The wheel that `python/run` built and installed.
    wanted = ["pogema-toolbox==0.1.1", os.environ["POGEMA_WHEEL"]]
    command = [sys.executable, "-m", "pip", "install", "--dry-run", "--ignore-installed", "--quiet"]
    done = subprocess.run([*command, "--report", str(report), *wanted], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = {one["metadata"]["name"]: one["metadata"]["version"] for one in json.loads(report.read_text())["install"]}
    expected = {"pogema": "1.4.0", "pogema-toolbox": "0.1.1", "pydantic": "1.9.1", "gymnasium": "0.28.1"}
    assert {name: found[name] for name in expected} == expected and "pogema-rs" in found


@pytest.mark.parametrize("order", [("pogema", "pogema_rs"), ("pogema_rs", "pogema")])
def test_both_packages_play_in_one_process(order, tmp_path):
    (tmp_path / "pogema_rs").symlink_to(Path(pogema_rs.__file__).parent)
    done = run(ORACLE, BOTH.format(first=order[0], second=order[1]), tmp_path)
    assert done.returncode == 0, done.stderr


def test_pogema_without_its_dependencies_does_not_run_on_pydantic_2(tmp_path):
    code = "import pogema; print(pogema.__file__)"
    there = Path(run(ORACLE, code, "").stdout.strip()).parent
    (tmp_path / "pogema").symlink_to(there)
    done = run(sys.executable, code, tmp_path)
    assert done.returncode == 1 and "PydanticUserError" in done.stderr, done.stderr
