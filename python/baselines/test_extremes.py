"""Tests that no number of a config, however large or small, ends a training run without a clear one-line error."""

import dataclasses
from typing import get_args, get_origin, get_type_hints

import pytest
from pogema_rs.baselines import load_config
from pogema_rs.baselines.__main__ import main
from small import changes

#: With more of these, a training run only takes longer.
COUNTS = {
    "environment.max_episode_steps",
    "learner.epochs",
    "learner.updates",
    "schedule.lanes",
    "schedule.validation_episodes",
    "schedule.validation_steps",
}


def numbers(method):
    """Yields the keys of all numbers in a config, with their type."""
    for section in dataclasses.fields(config := load_config(method)):
        values = getattr(config, section.name)
        if section.name == "encoder" or not dataclasses.is_dataclass(values):
            continue
        for key, kind in get_type_hints(type(values)).items():
            kind = get_args(kind)[0] if get_origin(kind) is tuple else kind
            if kind in (int, float):
                yield f"{section.name}.{key}", kind


def extremes(method):
    """Yields changes to a config with the smallest and the largest values of every number."""
    for key, kind in numbers(method):
        if kind is float:
            yield from (f"{key}={value}" for value in ("1e300", "1e30", "0", "1e-300", "-1e300"))
        else:
            yield from (f"{key}={value}" for value in (10**30, -(10**30), 0))
            if key not in COUNTS:
                yield f"{key}={10**9}"


# One method for each kind of learner, and MAPPO, which has a critic of its own.
@pytest.mark.parametrize("method", ["qmix", "follower", "mappo", "lswitcher"])
def test_extreme_numbers_train_or_fail_with_one_clear_line(method, tmp_path, capsys):
    keys, num_rejected = [key for key, _ in numbers(method)], 0
    for number, change in enumerate(extremes(method)):
        settings = [part for each in (*changes(method), change) for part in ("--set", each)]
        folder = tmp_path / str(number)
        status = main(["train", method, "--out", str(folder), "--iterations", "1", *settings])
        lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("train ")]
        assert status == 0 and lines == [] or status == 1 and len(lines) == 1, (change, lines)
        if status:
            num_rejected += 1
            # The rejected key may be another one, which no longer fits.
            assert any(key in lines[0] for key in (*keys, "bytes")), (change, lines)
    assert num_rejected > 60
