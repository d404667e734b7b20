"""Tests that scripts get the same results from pogema-toolbox on POGEMA 1.4.0 and from pogema_rs under their names."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import pogema_rs

HERE = Path(__file__).resolve().parent
# A run without the tests that need POGEMA still imports this module.
TOOLBOX = os.environ.get("POGEMA_TOOLBOX_FOLDER", "POGEMA_TOOLBOX_FOLDER is not set")
FOLDERS = os.pathsep.join([TOOLBOX, str(HERE / "stand_ins")])
# The last package runs in the Python environment of POGEMA 1.4.0, with pydantic 1.9, Gymnasium 0.28 and NumPy 1.26.
THEIRS, OURS, OURS_ON_OLD_STACK = "pogema", "pogema_rs.toolbox", "pogema_rs.toolbox on an old stack"
# The order in which `argsort` puts equal values depends on the release of NumPy and on the processor. Without vector
# instructions, all releases agree.
NO_VECTORS = {"NPY_DISABLE_CPU_FEATURES": "AVX2 AVX512F AVX512_SKX X86_V3 X86_V4"}
# The script imports `pogema_rs` and its toolbox under their own names.
MOVED = "changed imports"


def run(package, script, folder, *arguments):
    """Runs a script in a folder and returns its output."""
    folder.mkdir(exist_ok=True)
    python = sys.executable if package in ("pogema_rs", OURS, MOVED) else os.environ["POGEMA_ORACLE_PYTHON"]
    command = [python, "-B", str(HERE / "run_as.py"), package.split()[0], FOLDERS, str(HERE / script), *arguments]
    environment = {**os.environ, **NO_VECTORS, "CALLS_OF_WANDB": str(folder / "calls.txt")}
    if package == OURS_ON_OLD_STACK:
        alone = folder.parent / "package"
        alone.mkdir(exist_ok=True)
        link = alone / "pogema_rs"
        if not link.is_symlink():
            link.symlink_to(Path(pogema_rs.__file__).parent)
        environment["PYTHONPATH"] = str(alone)
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def evaluated(tmp_path_factory):
    """The results of the A* agent and a random policy, for each package."""
    folder = tmp_path_factory.mktemp("evaluated")
    packages = (THEIRS, "pogema_rs", OURS)
    return {package: json.loads(run(package, "evaluate.py", folder / package)) for package in packages}


@pytest.mark.parametrize("package", ["pogema_rs", OURS])
def test_evaluations_have_equal_results(evaluated, package):
    (theirs, _), (ours, _) = evaluated[THEIRS], evaluated[package]
    assert len(theirs) == 240
    assert len({json.dumps(result["metrics"]) for result in theirs}) > 60
    assert ours == theirs


def test_results_beside_a_suite_are_the_same_files(evaluated):
    theirs, ours = evaluated[THEIRS][1], evaluated[OURS][1]
    assert sorted(ours) == sorted(theirs) and "restart/restart.yaml" in theirs and len(theirs) == 9
    assert ours == theirs


@pytest.fixture(scope="module")
def scenarios(tmp_path_factory):
    """The return values of the functions of pogema-toolbox, for each package."""
    folder = tmp_path_factory.mktemp("scenarios")
    packages = (THEIRS, OURS, OURS_ON_OLD_STACK)
    return {package: json.loads(run(package, "scenarios.py", folder / package)) for package in packages}


NAMES = """mazes random_maps warehouses files_of_maps variants moving_ai tables logged_tables plots folders
    uploads shares_of_processes registry maps_of_many_resets""".split()


@pytest.mark.parametrize("name", NAMES)
def test_functions_return_the_same(scenarios, name):
    assert list(scenarios[THEIRS]) == NAMES
    assert scenarios[OURS][name] == scenarios[THEIRS][name]
    assert scenarios[OURS_ON_OLD_STACK][name] == scenarios[THEIRS][name]


def contents(folder):
    """Returns the content of each file in a folder, but only the names of pictures and archives."""
    names = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.name != "log.txt"]
    hidden = (".pdf", ".png", ".zip")
    return {str(path.relative_to(folder)): "" if path.suffix in hidden else path.read_text() for path in names}


def tables(folder):
    """Returns the lines of the tables in a log, if there is one."""
    if not (folder / "log.txt").exists():
        return []
    text = re.sub("\x1b\\[[0-9;]*m", "", (folder / "log.txt").read_text())
    return [line for line in text.splitlines() if line[:1] in ("+", "|")]


# A trainer, a data collector and an evaluation. Each is modelled on a public repository that its first lines name.
PROGRAMS = [("train_on_paths.py", 1), ("collect_expert_data.py", 12), ("evaluate_sets.py", 9)]
SCRIPTS = [*PROGRAMS, ("evaluate_lifelong.py", 5), ("make_and_show.py", 9)]
SLOW = {"train_on_paths.py", "evaluate_lifelong.py", "make_and_show.py"}


@pytest.mark.parametrize(
    ("script", "num_files"),
    [pytest.param(*each, marks=pytest.mark.slow if each[0] in SLOW else ()) for each in SCRIPTS],
)
def test_unmodified_scripts_write_the_same_files(script, num_files, tmp_path):
    found = []
    for package in (THEIRS, OURS, OURS_ON_OLD_STACK):
        folder = tmp_path / package
        shutil.copytree(HERE / "scripts" / "experiments", folder / "experiments")
        run(package, f"scripts/{script}", folder)
        found.append((contents(folder), tables(folder)))
    assert len(found[0][0]) >= num_files, found[0][0].keys()
    assert found[1] == found[0]
    assert found[2] == found[0]


# The changes that docs/guide/moving.md lists.
CHANGES = [
    ("from pogema_toolbox", "from pogema_rs.toolbox"),
    ("from pogema", "from pogema_rs"),
    ("import gymnasium\n", "import gymnasium\nimport pogema_rs\n"),
    ("(gymnasium.Wrapper)", "(pogema_rs.Wrapper)"),
    ("(gymnasium.ObservationWrapper)", "(pogema_rs.Wrapper, gymnasium.ObservationWrapper)"),
    ("eval_dir=folder)", 'eval_dir=folder, begin="replace")'),
    ("enumerate(actions):\n            self.made", "enumerate(self.executed_actions):\n            self.made"),
]


# Metrics that `evaluation` adds unless it stands in for the `evaluation` of pogema-toolbox.
ADDED = ("avg_agents_density", "a_collisions", "o_collisions", "runtime")


def without_added(name, text):
    """Returns the results in a file without the metrics that only this package adds, or the text of any other file."""
    results = json.loads(text) if Path(name).name in ("A*.json", "Random.json") else text
    if results is not text:
        for result in results:
            result["metrics"] = {key: value for key, value in result["metrics"].items() if key not in ADDED}
    return results


@pytest.mark.slow
@pytest.mark.parametrize(("script", "num_files"), PROGRAMS)
def test_scripts_with_changed_imports_write_the_same_files(script, num_files, tmp_path):
    text = (HERE / "scripts" / script).read_text()
    for before, after in CHANGES:
        text = re.sub(re.escape(before) + r"(?!_rs)", lambda _, after=after: after, text)
    moved = tmp_path / script
    moved.write_text(text)
    found = []
    for package, path in ((THEIRS, f"scripts/{script}"), (MOVED, moved)):
        folder = tmp_path / package
        shutil.copytree(HERE / "scripts" / "experiments", folder / "experiments")
        run(package, path, folder)
        found.append({name: without_added(name, text) for name, text in contents(folder).items()})
    assert len(found[0]) >= num_files, found[0].keys()
    assert found[1] == found[0]
