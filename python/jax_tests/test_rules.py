"""Plays `pogema_rs.jax` and `VecEnv` in lockstep: every observation, reward and end must be equal."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from pogema_rs import VecEnv
from pogema_rs.jax import InstancePool, observe, reset, step, step_and_reset

NUM_ENVS, NUM_STEPS = 24, 40
ROOMS = [
    {"size": 8, "num_agents": 12, "obs_radius": 2, "density": 0.2},
    {"size": 5, "num_agents": 8, "obs_radius": 5, "density": 0.1},
    {"size": 12, "num_agents": 60, "obs_radius": 3, "density": 0.0},
    {"size": 6, "num_agents": 1, "obs_radius": 1, "density": 0.3},
]


def compiled(pool):
    """Returns the functions of a pool for a batch of environments."""
    params, arrays = pool.params, pool.arrays
    first = jax.jit(jax.vmap(lambda index: reset(params, arrays, index)))
    advance = jax.jit(jax.vmap(lambda state, actions: step(params, arrays, state, actions)))
    look = jax.jit(jax.vmap(lambda state: observe(params, state)))
    return first, advance, look


def assert_equal(found, expected, where):
    found = np.asarray(found)
    assert found.dtype == expected.dtype, where
    different = np.argwhere(found != expected)
    assert len(different) == 0, f"{where}: first at {different[0]}"


@pytest.mark.parametrize("rewards", ["own", "shared"])
@pytest.mark.parametrize("semantics", ["1.4.0", "2.0"])
@pytest.mark.parametrize("on_target", ["finish", "nothing", "restart"])
@pytest.mark.parametrize("collision_system", ["priority", "block_both", "soft"])
@pytest.mark.parametrize("room", range(len(ROOMS)))
def test_episodes_are_those_of_the_fast_engine(room, collision_system, on_target, semantics, rewards):
    config = {**ROOMS[room], "collision_system": collision_system, "on_target": on_target}
    config["max_episode_steps"] = NUM_STEPS
    seeds = list(range(100 * room, 100 * room + NUM_ENVS))
    chosen = {"semantics": semantics, "rewards": rewards}
    pool = InstancePool(config, NUM_ENVS, seeds, **chosen)
    first, advance, look = compiled(pool)
    env = VecEnv(config, NUM_ENVS, autoreset_mode="Disabled", **chosen)
    seen, _ = env.reset(seed=seeds)
    state = first(jnp.arange(NUM_ENVS))
    assert_equal(look(state), seen, "first observations")
    dice, is_over = np.random.default_rng(room), np.zeros(NUM_ENVS, dtype=bool)
    while not is_over.all():
        actions = dice.integers(0, 5, (NUM_ENVS, pool.params.num_agents))
        seen, paid, terminated, truncated, _ = env.step(actions)
        state, outcome = advance(state, jnp.asarray(actions))
        # `VecEnv` keeps the final state of an episode, where POGEMA's rules continue.
        goes_on = ~is_over
        pairs = [(outcome.rewards, paid), (outcome.terminated, terminated), (outcome.truncated, truncated)]
        for found, expected in [(look(state), seen), *pairs]:
            assert_equal(np.asarray(found)[goes_on], expected[goes_on], f"step {int(state.num_steps[0])}")
        is_over |= (terminated | truncated).all(axis=1)
    assert int(state.num_wraps.sum()) == 0
    env.close()


def test_a_compiled_loop_with_automatic_resets_equals_single_steps():
    config = {**ROOMS[0], "on_target": "restart", "collision_system": "soft", "max_episode_steps": 7}
    pool = InstancePool(config, 5)
    params, arrays = pool.params, pool.arrays
    keys = jax.random.split(jax.random.key(3), 30)
    actions = jax.random.randint(jax.random.key(4), (30, params.num_agents), 0, 5)

    def one(state, given):
        state, outcome = step_and_reset(params, arrays, state, *given)
        return state, (outcome, observe(params, state))

    _, (outcomes, windows) = jax.jit(lambda: jax.lax.scan(one, reset(params, arrays, 2), (actions, keys)))()
    state, num_resets = reset(params, arrays, 2), 0
    for number in range(30):
        state, outcome = step(params, arrays, state, actions[number])
        for found, expected in zip(outcomes, outcome):
            assert_equal(found[number], np.asarray(expected), number)
        if bool(outcome.is_over):
            num_resets += 1
            state = reset(params, arrays, int(jax.random.randint(keys[number], (), 0, 5)))
        assert_equal(windows[number], np.asarray(observe(params, state)), number)
    assert num_resets == 4


def test_observations_have_the_same_values_as_bytes():
    pool = InstancePool(ROOMS[0], 1)
    state = reset(pool.params, pool.arrays, 0)
    found = observe(pool.params, state, jnp.uint8)
    assert found.dtype == jnp.uint8
    assert (np.asarray(found) == np.asarray(observe(pool.params, state))).all()


def test_goals_begin_again_after_the_last_one_and_are_counted():
    config = {"map": "..", "num_agents": 1, "obs_radius": 1, "on_target": "restart", "max_episode_steps": 1}
    pool = InstancePool({**config, "agents_xy": [[0, 0]], "targets_xy": [[[0, 1], [0, 0]]]}, 1)
    state = reset(pool.params, pool.arrays, 0)
    reached = 0
    for number in range(10):
        state, outcome = step(pool.params, pool.arrays, state, jnp.array([4 if number % 2 == 0 else 3]))
        reached += float(outcome.rewards[0])
    num_goals = int(state.goal_end[0] - state.goal_begin[0])
    assert reached == 10 and int(state.num_wraps) == 10 // num_goals


def test_a_pool_is_small():
    config = {"size": 32, "num_agents": 64, "density": 0.3, "on_target": "restart", "max_episode_steps": 256}
    assert InstancePool(config, 50).num_bytes * 10_000 / 50 < 60e6
