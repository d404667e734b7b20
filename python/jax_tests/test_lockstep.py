"""Plays the same episodes with JAX and with `VecEnv`, and compares every array of every step."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pogema_rs.jax as pj
import pytest
from pogema_rs import GridConfig, VecEnv

NUM_ENVS, NUM_STEPS, NUM_EPISODES = 28, 100, 50
RULES = list(
    itertools.product(
        ("priority", "block_both", "soft"), ("finish", "nothing", "restart"), ("1.4.0", "2.0"), ("own", "shared")
    )
)
# Sides, agents, radius, noise, and room for more agents and cells. Observations of the third, the fifth and the last
# shape are cut from the map; those of the others come from a table.
SHAPES = [
    (8, 10, 2, False, None, None),
    (7, 8, 5, True, 16, (9, 7)),
    (40, 9, 17, False, 9, (40, 70)),
    (5, 1, 1, True, 3, (5, 5)),
    (20, 3, 2, False, None, None),
    (34, 60, 7, True, None, None),
    (6, 4, 15, False, None, (7, 9)),
]


def test_the_rules_are_played_for_100_000_steps():
    assert len(RULES) * NUM_ENVS * NUM_STEPS >= 100_000


@jax.jit
def play(params, state, actions):
    """Plays a step of all environments."""
    return jax.vmap(pj.step, (None, 0, 0))(params, state, actions)


@jax.jit
def begin(params, instances):
    return jax.vmap(pj.reset, (None, 0))(params, instances)


@jax.jit
def see(params, state):
    """Returns observations, global states and densities."""
    windows = jax.vmap(lambda params, state: pj.observe(params, state, jnp.uint8), (None, 0))(params, state)
    return windows, *(jax.vmap(part, (None, 0))(params, state) for part in (pj.global_state, pj.agents_density))


def densities(windows, num_agents):
    """Returns, for each environment, the mean share of the free cells of a window that agents occupy."""
    counts = windows[:, :, :2].astype(np.int64).sum(axis=(-1, -2))
    free = windows.shape[-1] ** 2 - counts[..., 0]
    shares = np.where(free == 0, 0.0, counts[..., 1] / np.maximum(free, 1))
    return [share[:num].mean() for share, num in zip(shares, num_agents)]


@jax.jit
def select(chosen, new, old):
    """Returns the new states of the chosen environments, and the old ones of all others."""
    pick = jax.vmap(lambda is_new, new, old: jax.tree.map(lambda new, old: jnp.where(is_new, new, old), new, old))
    return pick(chosen, new, old)


def episode_seeds(seed):
    """Returns the seeds of all episodes: those of environment i are at i, i + NUM_ENVS and so on."""
    keys = ((env, episode) for episode in range(NUM_EPISODES) for env in range(NUM_ENVS))
    made = (np.random.SeedSequence(seed, spawn_key=key).generate_state(1, np.uint64)[0] for key in keys)
    return [int(each) % (2**63 - 1) for each in made]


@pytest.mark.parametrize("number", range(len(RULES)))
def test_every_array_equals_that_of_a_vec_env(number):
    collision, on_target, semantics, rewards = RULES[number]
    size, agents, radius, noise, num_agents, map_size = SHAPES[number % len(SHAPES)]
    config = GridConfig(
        size=size, num_agents=agents, obs_radius=radius, density=0.25, empty_outside=not noise, max_episode_steps=19,
        collision_system=collision, on_target=on_target,
    )  # fmt: skip
    pool = pj.InstancePool(
        config, NUM_ENVS * NUM_EPISODES, episode_seeds(number),
        num_agents=num_agents, map_size=map_size, rewards=rewards, semantics=semantics,
    )  # fmt: skip
    params = pool.params
    env = VecEnv(
        config, NUM_ENVS, dtype="uint8", semantics=semantics, rewards=rewards, num_agents=num_agents, map_size=map_size
    )
    expected, _ = env.reset(seed=number)
    instances = np.arange(NUM_ENVS)
    state = begin(params, instances)
    rng = np.random.default_rng(number)
    num_ended = 0
    for _ in range(NUM_STEPS):
        windows, seen, density = see(params, state)
        np.testing.assert_array_equal(windows, expected)
        np.testing.assert_allclose(density, densities(expected, np.asarray(state.num_agents)), rtol=1e-6)
        for name, values in env.state().items():
            found = getattr(seen, name)
            if name == "obstacles":
                # Outside a smaller map, `VecEnv` returns obstacles, and `global_state` the cells of the border.
                found, values = found[:, :size, :size], values[:, :size, :size]
            np.testing.assert_array_equal(found, values, err_msg=name)
        actions = rng.integers(5, size=(NUM_ENVS, pool.config.num_agents))
        expected, *ends, infos = env.step(actions)
        state, out = play(params, state, actions)
        for actual, values in zip(out, ends):
            np.testing.assert_array_equal(actual, values)
        ended = np.flatnonzero(out.ended)
        assert ("metrics" in infos) == (len(ended) > 0)
        if len(ended) == 0:
            continue
        num_ended += len(ended)
        final, *_ = see(params, state)
        compare_ends(pool, state, final, ended, infos)
        assert not np.asarray(state.num_wraps).any() and not np.asarray(state.num_clipped).any()
        instances[ended] += NUM_ENVS
        state = select(out.ended, begin(params, instances), state)
    assert num_ended >= NUM_ENVS * (NUM_STEPS // 19)


def compare_ends(pool, state, final, ended, infos):
    """Compares the last observations and the metrics of ended episodes."""
    num_agents = np.asarray(state.num_agents)
    rounded = jax.vmap(pj.metrics, (None, 0, 0, None))(
        pool.config, state.counts, state.num_agents, pool.params.max_steps
    )
    for env in ended:
        np.testing.assert_array_equal(final[env], infos["final_obs"][env])
        counts = jax.tree.map(lambda leaf, env=env: leaf[env], state.counts)
        exact = pj.exact_metrics(pool.config, counts, int(num_agents[env]), int(pool.params.max_steps))
        names = [name for name in infos["metrics"] if not name.startswith("_")]
        assert sorted(exact) == sorted(names)
        for name in names:
            assert exact[name] == infos["metrics"][name][env], name
            assert abs(float(rounded[name][env]) - exact[name]) <= 1e-6 * max(1, abs(exact[name])), name
