"""Tests that every name of POGEMA 1.4.0 and pogema-toolbox 0.1.1 exists here, or is in the table of differences.

The table is in docs/guide/moving.md, between two comments. `POGEMA_ORACLE_PYTHON` names the interpreter with POGEMA,
and `POGEMA_TOOLBOX_FOLDER` the folder with pogema-toolbox and its imports.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).resolve().parent
STAND_INS = HERE.parent / "toolbox" / "stand_ins"
PAGE = HERE.parent.parent.parent / "docs" / "guide" / "moving.md"
TABLE = re.compile(r"<!-- surface -->\n(.*?)<!-- end of surface -->", re.DOTALL)
MAX_ROWS = 25

Surface = dict[str, Any]


# The tests of the rows about behaviour, by the first cell of a row.
BEHAVIOUR = {
    "`move_agents`, `_revert_action`, `update_was_on_goal`, `_initialize_grid`, `_generate_new_target`, and private "
    "helpers of `Grid`, `GridConfig` and `ToolboxRegistry`": (
        "surface/test_overrides.py",
        "def test_an_overridden_method_is_called_or_rejected",
    ),
    "`grid.positions_xy`, `finishes_xy`, `starts_xy`, `is_active` and all other state": (
        "surface/test_writing.py",
        "def test_attribute_cannot_be_set_or_changed",
    ),
    "`grid.move`, `hide_agent` and the other methods that change a grid": (
        "oracle/intended.py",
        '"write-protected grid"',
    ),
    "lists given to `GridConfig`": ("surface/test_writing.py", "def test_lists_given_to_a_config_are_copied"),
    "`Grid(config, add_artificial_border=False)`": (
        "surface/test_writing.py",
        "def test_grid_without_border_is_rejected",
    ),
    "`env.grid_config = other`": ("surface/test_writing.py", "def test_config_of_an_environment_can_be_replaced"),
    "`pogema.__version__` after `install_as_pogema()`": ("surface/test_writing.py", "def test_version_is_our_own"),
    "`env.step(actions)`": ("surface/test_behaviour.py", "def test_actions_of_the_caller_stay_unchanged"),
    "`save_animation` and `render_animation`": (
        "test_animations.py",
        "def test_settings_of_a_monitor_take_effect",
    ),
    "`possible_agents_xy`, `possible_targets_xy`": (
        "test_environment.py",
        "def test_lists_of_the_caller_are_unchanged",
    ),
    "`get_agents_xy(only_active=True)`, `get_state(ignore_borders=True)`": (
        "oracle/intended.py",
        '"only active agents"',
    ),
    "`evaluation(suite, folder)` of pogema-toolbox": (
        "toolbox/test_evaluations.py",
        "def test_import_of_pogema_rs_keeps_earlier_results",
    ),
    "the maps `pogema-logo` and `four-rooms` of pogema-toolbox": (
        "toolbox/test_maps.py",
        "def test_maps_of_the_toolbox_are_read_from_its_installation",
    ),
    "`MOVES`": ("oracle/intended.py", '"other moves"'),
    "`GridConfig` with an unknown field": (
        "test_environment.py",
        "def test_unknown_field_is_ignored_with_one_warning",
    ),
    "the PettingZoo adapter": ("test_frameworks.py", "def test_pettingzoo_supports_mapf_observations"),
}


def rows() -> list[list[str]]:
    """Returns the cells of each row of the table."""
    found = TABLE.search(PAGE.read_text(encoding="utf-8"))
    assert found, f"{PAGE} has no table between the comments"
    lines = [line for line in found[1].splitlines() if line.startswith("|")][2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def first_cells() -> list[str]:
    """Returns the first cell of each row of the table."""
    return [row[0] for row in rows()]


def patterns() -> list[str]:
    """Returns the patterns of names in the rows that are not about behaviour."""
    return [name for cell in first_cells() if cell not in BEHAVIOUR for name in re.findall(r"`([^`]+)`", cell)]


@pytest.fixture(scope="module")
def surfaces() -> tuple[Surface, Surface]:
    """The surface of POGEMA, and ours after `install_as_pogema`."""
    sides = ((os.environ["POGEMA_ORACLE_PYTHON"], "pogema"), (sys.executable, "pogema_rs"))
    command = [str(HERE / "walk.py")]
    runs = [
        subprocess.run(
            [python, "-B", *command, package, os.environ["POGEMA_TOOLBOX_FOLDER"], str(STAND_INS)],
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
        for python, package in sides
    ]
    for run in runs:
        assert run.returncode == 0, run.stderr
    theirs, ours = (json.loads(run.stdout) for run in runs)
    return theirs, ours


def differences(theirs: Surface, ours: Surface) -> Iterator[tuple[str, str]]:
    """Yields missing names, functions that cannot be called like POGEMA's, and attributes of another kind."""
    for path, what in theirs.items():
        if path not in ours:
            yield path, "is missing"
        elif isinstance(what, list) and not (isinstance(ours[path], list) and accepts(ours[path], what)):
            yield path, f"has the parameters {ours[path]}, expected {what}"
        elif path.startswith("<") and not isinstance(what, list) and what != ours[path]:
            yield path, f"is a {ours[path]}, expected a {what}"


def accepts(ours: list, theirs: list) -> bool:
    """Returns whether a function can be called in every way in which POGEMA's can."""
    kinds = {kind for _, kind, _ in ours}
    by_name = {name: (index, kind, default) for index, (name, kind, default) in enumerate(ours)}
    for index, (name, kind, default) in enumerate(theirs):
        if kind.startswith("VAR_"):
            if kind not in kinds:
                return False
        elif name not in by_name:
            if kind == "POSITIONAL_OR_KEYWORD" or "VAR_KEYWORD" not in kinds:
                return False
        elif kind == "POSITIONAL_OR_KEYWORD" and by_name[name][:2] != (index, kind):
            return False
        elif default is not None and by_name[name][2] != default and (default, by_name[name][2]) != ("object", "None"):
            return False
    names = {name for name, _, _ in theirs}
    return all(name in names or default is not None or kind.startswith("VAR_") for name, kind, default in ours)


def test_every_name_exists_or_is_in_the_table(surfaces: tuple[Surface, Surface]) -> None:
    known = patterns()
    found = [
        f"{path} {reason}"
        for path, reason in differences(*surfaces)
        if not any(fnmatchcase(path, pattern) for pattern in known)
    ]
    assert found == []


def test_every_row_of_the_table_is_a_difference(surfaces: tuple[Surface, Surface]) -> None:
    paths = [path for path, _ in differences(*surfaces)]
    stale = [pattern for pattern in patterns() if not any(fnmatchcase(path, pattern) for path in paths)]
    assert stale == []


def test_table_is_short_and_its_rows_are_tested() -> None:
    cells = first_cells()
    assert len(cells) <= MAX_ROWS and set(BEHAVIOUR) <= set(cells)
    for file, test in BEHAVIOUR.values():
        assert test in (HERE.parent / file).read_text(encoding="utf-8"), f"{file} has no {test}"
    assert all(len(row) == 3 and all(row) for row in rows()), "a row does not say what differs and what a user does"
    assert all("`" in cell for cell in cells if cell not in BEHAVIOUR)


def test_walk_finds_the_surface(surfaces: tuple[Surface, Surface]) -> None:
    theirs, _ = surfaces
    expected = {
        "pogema.envs.PogemaLifeLong._generate_new_target",
        "pogema.grid_config.GridConfig.str_map_to_list",
        "pogema.wrappers.metrics.AbstractMetric._compute_stats",
        "pogema_toolbox.evaluator.evaluation",
        "<env restart>.random_generators",
        "<env.grid restart>.point_to_component",
    }
    assert expected <= theirs.keys() and len(theirs) > 1000


PARAMETERS = [["a", "POSITIONAL_OR_KEYWORD", None], ["b", "POSITIONAL_OR_KEYWORD", "1"]]


@pytest.mark.parametrize(
    ("ours", "fits"),
    [
        (PARAMETERS, True),
        ([["a", "POSITIONAL_OR_KEYWORD", None], ["b", "POSITIONAL_OR_KEYWORD", "2"]], False),
        ([["b", "POSITIONAL_OR_KEYWORD", "1"], ["a", "POSITIONAL_OR_KEYWORD", None]], False),
        ([["a", "POSITIONAL_OR_KEYWORD", None]], False),
        ([*PARAMETERS, ["c", "KEYWORD_ONLY", None]], False),
        ([PARAMETERS[0], ["b", "KEYWORD_ONLY", "1"]], False),
        ([*PARAMETERS, ["c", "KEYWORD_ONLY", "0"]], True),
    ],
)
def test_parameters_are_compared(ours: list, fits: bool) -> None:
    assert accepts(ours, PARAMETERS) is fits
