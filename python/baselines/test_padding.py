"""Tests that padding, the rows of agents that an iteration lacks, does not change a training run."""

import numpy as np
import pytest
from small import small_config

from pogema_rs.baselines import Budget, _checkpoint, _lswitcher, _ppo, _record, train


@pytest.mark.parametrize("method", ["follower", "epom", "mappo", "lswitcher"])
def test_rows_of_padding_do_not_change_the_weights(method, tmp_path, monkeypatch):
    imitates = ["imitation.iterations=1"] if method == "epom" else []
    config = small_config(method, "environment.num_agents=[1,3]", *imitates)
    shapes, found = [], []

    def trimmed(record):
        small = _record.without_padding(record)
        shapes.append((record.shape[2], small.shape[2]))
        return small

    for name, choose in (("trimmed", trimmed), ("padded", lambda record: record)):
        for module in (_ppo, _lswitcher):
            monkeypatch.setattr(module, "without_padding", choose)
        train(config, tmp_path / name, Budget(iterations=2), seed=3)
        saved = _checkpoint.load(tmp_path / name / "checkpoint.pt", method)
        found.append({name: values.numpy() for name, values in saved["learner"]["modules"][0].items()})
    # The critic of MAPPO reads all agents of the global state.
    assert shapes == ([] if method == "mappo" else [(3, 1), (3, 3)])
    for name, values in found[0].items():
        np.testing.assert_allclose(values, found[1][name], atol=1e-6)
