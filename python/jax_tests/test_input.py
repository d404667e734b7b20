"""Tests that wrong arguments raise one clear error before anything is compiled."""

import subprocess
import sys

import jax.numpy as jnp
import pytest

from pogema_rs.jax import InstancePool, Params, reset, step

CONFIG = {"size": 6, "num_agents": 3, "density": 0.1}


@pytest.mark.parametrize("num", [0, -1, True, 2.0, "2"])
def test_wrong_sizes_of_a_pool(num):
    with pytest.raises(ValueError, match="num is .*, expected a whole number from 1"):
        InstancePool(CONFIG, num)


def test_wrong_number_of_seeds():
    with pytest.raises(ValueError, match="seeds has 2 values, expected 3, one per instance"):
        InstancePool(CONFIG, 3, [1, 2])


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({"collision_system": "hard"}, "collision_system is 'hard', expected one of priority, block_both, soft"),
        ({"on_target": "stay"}, "on_target is 'stay', expected one of finish, nothing, restart"),
        ({"height": 0}, "height is 0, expected at least 1"),
        ({"height": 2**16, "width": 2**16}, "cells, expected at most 1073741824"),
        ({"max_episode_steps": 2**31}, "max_episode_steps is 2147483648, expected at most 2147483647"),
    ],
)
def test_wrong_parameters(fields, error):
    with pytest.raises(ValueError, match=error):
        Params(**{"num_agents": 2, "height": 5, "width": 5, **fields})


def test_wrong_rewards_and_semantics():
    with pytest.raises(ValueError, match="rewards is 'mean', expected 'own' or 'shared'"):
        InstancePool(CONFIG, 1, rewards="mean")
    with pytest.raises(ValueError, match="'3.0' is not a valid Semantics"):
        InstancePool(CONFIG, 1, semantics="3.0")


@pytest.mark.parametrize(
    ("actions", "kind", "error"),
    [
        (jnp.zeros(2, jnp.int32), ValueError, r"actions has shape \(2,\), expected \(3,\)"),
        (jnp.zeros((1, 3), jnp.int32), ValueError, r"actions has shape \(1, 3\), expected \(3,\)"),
        (jnp.zeros(3), TypeError, "actions has type float32, expected integers"),
    ],
)
def test_wrong_actions(actions, kind, error):
    pool = InstancePool(CONFIG, 1)
    with pytest.raises(kind, match=error):
        step(pool.params, pool.arrays, reset(pool.params, pool.arrays, 0), actions)


def test_actions_outside_the_range_are_clipped():
    pool = InstancePool(CONFIG, 1)
    state = reset(pool.params, pool.arrays, 0)
    for wrong, right in ((7, 4), (-3, 0)):
        found, _ = step(pool.params, pool.arrays, state, jnp.full(3, wrong))
        expected, _ = step(pool.params, pool.arrays, state, jnp.full(3, right))
        assert (found.cells == expected.cells).all()


def test_the_package_imports_no_jax():
    code = "import sys, pogema_rs, pogema_rs.vec_env; assert 'jax' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_missing_jax_is_one_line():
    code = "import sys; sys.modules['jax'] = None\ntry:\n    import pogema_rs.jax\nexcept ImportError as error:\n    print(error)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "pogema_rs.jax needs `pip install 'pogema-rs[jax]'`\n"
