"""Tests that arrays pass between `pogema_rs.jax` and PyTorch without a copy."""

import gc

import jax
import jax.numpy as jnp
import numpy as np
import pogema_rs.jax as pj
import pytest
import torch

if jax.default_backend() != "cpu":
    pytest.skip("the tests read arrays in the memory of the host", allow_module_level=True)

NUM_ENVS, NUM_AGENTS = 16, 8
CONFIG = {"size": 12, "num_agents": NUM_AGENTS, "collision_system": "soft", "on_target": "restart"}


@pytest.fixture(scope="module")
def params():
    return pj.InstancePool(CONFIG, NUM_ENVS).params


@pytest.fixture
def states(params):
    return jax.jit(lambda: jax.vmap(pj.reset, (None, 0))(params, jnp.arange(NUM_ENVS)))()


def over_envs(function, params, *each):
    return jax.jit(jax.vmap(function, (None, *(0 for _ in each))))(params, *each)


def address(array):
    return array.data_ptr() if isinstance(array, torch.Tensor) else array.unsafe_buffer_pointer()


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.uint8, jnp.bool_])
def test_windows_become_tensors(params, states, dtype):
    windows = over_envs(lambda params, state: pj.observe(params, state, dtype), params, states)
    tensor = torch.from_dlpack(windows)
    assert tensor.dtype == getattr(torch, windows.dtype.name)
    assert address(tensor) == address(windows)
    np.testing.assert_array_equal(tensor.cpu().numpy(), windows)


def test_rows_and_masks_become_tensors(params, states):
    for function in (pj.observe_rows, pj.action_masks):
        array = over_envs(function, params, states)
        tensor = torch.from_dlpack(array)
        assert address(tensor) == address(array)
        np.testing.assert_array_equal(tensor.cpu().numpy(), array)


def test_a_tensor_outlives_its_array(params, states):
    windows = over_envs(pj.observe, params, states)
    expected, tensor = np.array(windows), torch.from_dlpack(windows)
    del windows
    gc.collect()
    over_envs(pj.observe, params, states).block_until_ready()
    np.testing.assert_array_equal(tensor.cpu().numpy(), expected)


@pytest.mark.parametrize("dtype", [torch.int32, torch.int8, torch.uint8])
def test_tensors_become_actions(params, states, dtype):
    drawn = np.random.default_rng(0).integers(5, size=(NUM_ENVS, NUM_AGENTS))
    tensor = torch.tensor(drawn, dtype=dtype)
    actions = jnp.from_dlpack(tensor)
    assert address(actions) == address(tensor)
    played = over_envs(pj.step, params, states, actions)
    expected = over_envs(pj.step, params, states, jnp.asarray(drawn, jnp.int32))
    for found, wanted in zip(jax.tree.leaves(played), jax.tree.leaves(expected)):
        np.testing.assert_array_equal(found, wanted)
