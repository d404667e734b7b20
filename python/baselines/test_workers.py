"""Tests the threads that share the work of a network."""

import copy

import numpy as np
import pytest
import torch
from small import small_config

from pogema_rs.baselines import _workers
from pogema_rs.baselines._config import METHODS
from pogema_rs.baselines._networks import AgentNetwork
from pogema_rs.baselines._run import Budget, train
from pogema_rs.baselines._workers import Workers
from safetensors.numpy import load_file

CONVOLUTIONS = ("network.filters=4", "network.blocks=1")
SCALARS = ("encoder.scalars=[goal_offset]",)


def features_of(network, threads, windows, scalars):
    """Returns features, states and gradients that a copy of a network computes with a number of threads."""
    with Workers(threads) as workers:
        network = copy.deepcopy(network)
        network._workers = workers
        with torch.no_grad():
            played, state = network.features(windows[:1], scalars[:1])
            later, state = network.features(windows[1:2], scalars[1:2], state)
        features, _ = network.features(windows, scalars)
        network.policy(features).square().sum().backward()
    states = [] if state is None else [state]
    torch.testing.assert_close(torch.cat([played, later]), features[:2])
    return [features.detach(), *states, *(one.grad for one in network.parameters() if one.grad is not None)]


@pytest.mark.parametrize("changes", [(), CONVOLUTIONS, SCALARS, ("network.recurrent=0", *CONVOLUTIONS)])
def test_threads_change_results_only_by_rounding(changes, monkeypatch):
    monkeypatch.setattr(_workers, "WINDOWS_PER_SHARE", 1)
    config = small_config("ippo", *changes)
    torch.manual_seed(0)
    network = AgentNetwork(config.encoder, config.network, has_value=True)
    windows = torch.rand(5, 7, int(np.prod(config.encoder.shape)))
    scalars = torch.rand(5, 7, 2 * len(config.encoder.scalars))
    alone = features_of(network, 1, windows, scalars)
    assert all(one.abs().sum() > 0 for one in alone)
    for threads in (2, 3, 20):
        shared = features_of(network, threads, windows, scalars)
        assert len(shared) == len(alone)
        for one, other in zip(shared, alone):
            torch.testing.assert_close(one, other)
        for one, other in zip(features_of(network, threads, windows, scalars), shared):
            assert torch.equal(one, other)


def test_an_error_in_a_thread_reaches_the_caller():
    with Workers(3) as workers:
        for place in range(3):
            with pytest.raises(ZeroDivisionError):
                workers.map(lambda number: 1 // number, [(int(place != one),) for one in range(3)])
        assert workers.map(lambda number: 6 // number, [(1,), (2,), (3,)]) == [6, 3, 2]


def test_gradients_are_off_and_pytorch_has_one_thread_in_all_threads_that_play():
    def found(_):
        return torch.get_num_threads(), torch.zeros(1, requires_grad=True).exp().requires_grad

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with Workers(4) as workers:
            assert workers.map(torch.no_grad()(found), [(one,) for one in range(4)]) == [(1, False)] * 4
    finally:
        torch.set_num_threads(before)


@pytest.mark.parametrize("method", METHODS)
def test_a_resumed_run_with_two_threads_has_the_weights_of_a_whole_one(method, tmp_path, monkeypatch):
    monkeypatch.setattr(_workers, "WINDOWS_PER_SHARE", 1)
    for name, parts in (("whole", (4,)), ("resumed", (2, 4))):
        for count in parts:
            config = small_config(method)
            train(config, tmp_path / name, Budget(iterations=count), threads=2, resume=count > parts[0])
    whole, resumed = (load_file(tmp_path / name / "weights.safetensors") for name in ("whole", "resumed"))
    assert whole.keys() == resumed.keys()
    for name, values in whole.items():
        np.testing.assert_array_equal(values, resumed[name])
