"""Tests that pogema_rs and POGEMA 1.4.0 return equal values for random configs and calls.

`POGEMA_ORACLE_PYTHON` names the interpreter with POGEMA 1.4.0. `POGEMA_ORACLE_CASES` is the number of cases [default:
1000], and `POGEMA_ORACLE_SEED` their seed [default: 1].
"""

from __future__ import annotations

import os
from collections.abc import Iterator

import generators
import pytest
from compare import Comparison
from configs import COLLISIONS, MAPS, OBSERVATIONS, ON_TARGET, PLACES
from intended import INTENDED
from live import Run, oracle
from scripts import CONTAINERS, case

from pogema_rs import generator
from pogema_rs.grid_config import GridConfig

NUM_CASES = int(os.environ.get("POGEMA_ORACLE_CASES", "1000"))
SEED = int(os.environ.get("POGEMA_ORACLE_SEED", "1"))

KINDS = (
    *(f"on_target {name}" for name in ON_TARGET),
    *(f"collision_system {name}" for name in COLLISIONS),
    *(f"observation_type {name}" for name in OBSERVATIONS),
    *(f"map {name}" for name in MAPS),
    *(f"places {name}" for name in PLACES),
    *(f"radius {radius}" for radius in range(1, 7)),
    *(f"actions as {name}" for name in CONTAINERS),
    *("persistent", "empty_outside False", "cells as tuples", "goal sequences", "no steps", "places letters"),
    *("agents_xy alone", "targets_xy alone", "possible_agents_xy alone", "possible_targets_xy alone"),
    *(
        "rejected config",
        "rejected at the reset",
        "odd config",
        "intended difference",
        "before the reset",
        "reset with a seed",
    ),
    *("step", "odd action", "wrong action", "sampled actions", "seed changed", "config updated", "config replaced"),
    *("grid of a config", "render", "history", "no history", "step back", "elapsed steps"),
)
"""The kinds that the drawn cases must cover, each at least once in 250 cases."""


@pytest.fixture(scope="module")
def run() -> Iterator[Run]:
    """All cases, played once."""
    run = Run(SEED, range(NUM_CASES))
    run.play()
    print(f"\n{run}")
    yield run


def test_everything_is_equal(run: Run) -> None:
    """No call differs, except for the intended differences."""
    assert not run.differences, "\n\n".join(str(difference) for difference in run.differences)


@pytest.mark.skipif(NUM_CASES < 1000, reason="too few cases to cover everything")
def test_cases_cover_everything(run: Run) -> None:
    """Every kind occurs often enough to be meaningful."""
    rare = {kind: run.kinds[kind] for kind in KINDS if run.kinds[kind] < NUM_CASES / 250}
    assert not rare, f"too few of {NUM_CASES} cases have these kinds: {rare}"
    assert not set(run.kinds) - set(KINDS), "a drawn kind is missing from KINDS"
    assert run.comparison.num_steps > NUM_CASES
    assert run.comparison.num_ends > NUM_CASES / 20
    assert run.comparison.num_warnings > NUM_CASES / 100
    assert run.comparison.num_metrics > NUM_CASES / 20


@pytest.mark.parametrize("difference", INTENDED, ids=lambda difference: difference.name)
def test_intended_differences_exist(difference: object) -> None:
    """Each intended difference exists, and has the described errors."""
    assert Run.play_intended(difference) is None


def test_generators_draw_the_same() -> None:
    """The functions that draw instances return the same values and consume equally many random numbers."""
    with oracle() as pogema:
        for number in range(generators.NUM_CASES):
            pogema.ask(number)
            assert generators.drawn(generator, GridConfig, number) == pogema.answer(), number


def test_case_is_a_function_of_its_number() -> None:
    """A case does not depend on earlier draws."""
    assert repr(case(SEED, 17)) == repr(case(SEED, 17)) != repr(case(SEED + 1, 17))


def test_missing_oracle_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without POGEMA the tests fail; they are not skipped."""
    monkeypatch.delenv("POGEMA_ORACLE_PYTHON", raising=False)
    with pytest.raises(RuntimeError, match="POGEMA_ORACLE_PYTHON is not set"), oracle():
        pass


def test_differences_are_found() -> None:
    """A value of another type, an extra error and a changed value are reported."""
    some = case(SEED, next(number for number in range(99) if "step" in case(SEED, number).kinds))
    with oracle() as pogema:
        pogema.ask(some.script)
        right = pogema.answer()
    index = next(i for i, call in enumerate(some.script) if call[0] == "reset")
    for wrong in ({"value": ("list", ())}, {"error": (["ValueError"], "")}, {"value": repr(right[index]["value"])}):
        changed = [*right[:index], {**wrong, "warnings": []}, *right[index + 1 :]]
        found = Comparison().compare(some, right, changed)
        assert found is not None and found.index == index and str(found)
    assert Comparison().compare(some, right, right) is None
