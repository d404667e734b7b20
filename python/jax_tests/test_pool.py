"""Tests pools, their goals and refills, and the functions that compute numbers exactly, against `VecEnv` and NumPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pogema_rs
import pogema_rs.jax as pj
import pytest
from pogema_rs import GridConfig, VecEnv
from pogema_rs.jax._division import nearest_quotient
from pogema_rs.jax._pool import draw_instance, first_seeds
from pogema_rs.packed import words_per_agent


def lifelong(**changes):
    fields = {"size": 8, "num_agents": 4, "density": 0.2, "obs_radius": 2, "max_episode_steps": 64, **changes}
    return GridConfig(on_target="restart", collision_system="soft", **fields)


def test_one_seed_gives_the_first_episodes_of_children_of_that_seed():
    config = lifelong()
    pool = pj.InstancePool(config, 9, 5)
    child = np.random.SeedSequence(5, spawn_key=(7,)).generate_state(1, np.uint64)[0]
    alone = pj.InstancePool(config, 1, [int(child) % (2**63 - 1)])
    every, one = pj.reset(pool.params, 7), pj.reset(alone.params, 0)
    jax.tree.map(np.testing.assert_array_equal, every._replace(instance=0), one._replace(instance=0))


def test_10_000_instances_take_less_than_60_megabytes():
    config = lifelong(size=32, num_agents=64, obs_radius=5, max_episode_steps=256)
    pool = pj.InstancePool(config, 10_000)
    assert pool.num_bytes < 60e6
    env = VecEnv(config, 1)
    env.reset(seed=[first_seeds(0, 10_000)[9_999]])
    seen, expected = pj.global_state(pool.params, pj.reset(pool.params, 9_999)), env.state()
    for name, values in expected.items():
        np.testing.assert_array_equal(getattr(seen, name), values[0], err_msg=name)


@pytest.mark.parametrize(("on_target", "num_compiled"), [("restart", 2), ("finish", 1)])
def test_a_refill_changes_the_instances_and_seldom_compiles(on_target, num_compiled):
    config = lifelong().model_copy(update={"on_target": on_target})
    pool = pj.InstancePool(config, 16, 1)
    compiled = 0

    @jax.jit
    def begin(params):
        nonlocal compiled
        compiled += 1
        return jax.vmap(pj.reset, (None, 0))(params, jnp.arange(16))

    before = begin(pool.params)
    for seed in (2, 3, 4, 5):
        after = begin(pool.refill(seed))
        assert (np.asarray(before.cells) != np.asarray(after.cells)).any()
        fresh = jax.vmap(pj.reset, (None, 0))(pj.InstancePool(config, 16, seed).params, jnp.arange(16))
        jax.tree.map(np.testing.assert_array_equal, after._replace(instance=0), fresh._replace(instance=0))
        before = after
        keys = jax.random.split(jax.random.key(seed), 200)
        drawn = jax.vmap(draw_instance, (None, 0))(pool.params, keys)
        assert sorted(set(np.asarray(drawn).tolist())) == [*range(16)]
    assert compiled == num_compiled


@pytest.mark.parametrize("on_target", ["finish", "nothing", "restart"])
def test_episodes_that_run_do_not_notice_a_refill(on_target):
    config = lifelong(size=6, max_episode_steps=40).model_copy(update={"on_target": on_target})
    pool = pj.InstancePool(config, 8, 1)
    play = jax.jit(jax.vmap(pj.step, (None, 0, 0)))
    rng = np.random.default_rng(0)
    for seed in range(2, 7):
        state = jax.vmap(pj.reset, (None, 0))(pool.params, jnp.arange(8))
        old, expected = pool.params, state
        for number in range(40):
            if number == 20:
                pool.refill(seed)
            actions = rng.integers(5, size=(8, 4))
            expected, expected_out = play(old, expected, actions)
            state, out = play(pool.params, state, actions)
            jax.tree.map(np.testing.assert_array_equal, (state, out), (expected, expected_out))
        if on_target == "restart":
            assert int(state.goal_index.max()) > 0, "no agent reached a goal"


def test_goals_that_run_out_begin_again_and_are_counted():
    config = GridConfig(map="...", agents_xy=[[0, 0]], targets_xy=[[[0, 1], [0, 2]]], on_target="restart", obs_radius=1)
    params = pj.InstancePool(config, 1).params
    state, goals = pj.reset(params, 0), []
    for action in (4, 4, 3, 4):
        state, _ = pj.step(params, state, jnp.array([action]))
        goals.append(state.goals[0].tolist())
    assert goals == [[0, 2], [0, 1], [0, 2], [0, 1]] and int(state.num_wraps) == 2


def test_goals_suffice_for_the_steps_that_they_were_made_for():
    # On a map of two cells, the only agent reaches a goal in every step.
    config = GridConfig(map="..", num_agents=1, on_target="restart", obs_radius=1, max_episode_steps=50)
    params = pj.InstancePool(config, 3, 4).params
    state = pj.reset(params, 1)
    step = jax.jit(pj.step)
    for _ in range(50):
        right = state.goals[0, 1] - state.cells[0, 1]
        state, _ = step(params, state, jnp.where(right > 0, 4, jnp.where(right < 0, 3, 0))[None])
    assert int(state.num_wraps) == 0 and int(state.goal_index[0]) == 50


def test_episodes_follow_each_other_inside_a_compiled_scan():
    pool = pj.InstancePool(lifelong(max_episode_steps=7), 32)

    def body(carry, key):
        state, seen = carry
        draw, act = jax.random.split(key)
        actions = jax.random.randint(act, (6, 4), 0, 5)
        keys = jax.random.split(draw, 6)
        state, out, _ = jax.vmap(pj.auto_reset, (None, 0, 0, 0))(pool.params, keys, state, actions)
        seen = jax.vmap(pj.observe, (None, 0))(pool.params, state)
        return (state, seen), (out.ended, state.step, state.instance)

    state = jax.vmap(pj.reset, (None, 0))(pool.params, jnp.arange(6))
    seen = jax.vmap(pj.observe, (None, 0))(pool.params, state)
    keys = jax.random.split(jax.random.key(0), 30)
    (state, _), (ended, steps, instances) = jax.jit(lambda carry: jax.lax.scan(body, carry, keys))((state, seen))
    assert np.asarray(ended).sum() == 6 * (30 // 7)
    np.testing.assert_array_equal(np.asarray(steps) == 0, ended)
    assert len(set(np.asarray(instances).ravel().tolist())) > 10


def test_auto_reset_is_a_step_and_the_reset_of_a_drawn_instance():
    config = lifelong(max_episode_steps=3)
    params = pj.InstancePool(config, 32).params
    state = pj.reset(params, 5)
    rng = np.random.default_rng(0)
    for number in range(7):
        actions, key = rng.integers(5, size=4), jax.random.key(number)
        after, out = pj.step(params, state, actions)
        given, found, last = pj.auto_reset(params, key, state, actions)
        jax.tree.map(np.testing.assert_array_equal, (last, found), (after, out))
        drawn = draw_instance(params, key)
        expected = pj.reset(params, drawn) if bool(out.ended) else after
        assert bool(out.ended) == (number % 3 == 2)
        jax.tree.map(np.testing.assert_array_equal, given, expected)
        state = given


@pytest.mark.parametrize("radius", [1, 5, 15, 16, 33])
def test_windows_have_the_same_values_in_every_type(radius):
    config = lifelong(size=12, num_agents=20, density=0.1, obs_radius=radius)
    params = pj.InstancePool(config, 1).params
    state = pj.reset(params, 0)
    expected = np.asarray(pj.observe(params, state, jnp.uint8))
    assert expected.any(axis=(0, 2, 3)).all() and not expected.all(axis=(0, 2, 3)).any()
    for dtype in (jnp.float32, jnp.bool_, jnp.int32, jnp.bfloat16):
        windows = jax.jit(lambda params, state, dtype=dtype: pj.observe(params, state, dtype))(params, state)
        assert windows.dtype == dtype
        np.testing.assert_array_equal(np.asarray(windows.astype(jnp.float32)), expected)
        rows = pj.unpack_rows(pj.observe_rows(params, state), radius, dtype)
        np.testing.assert_array_equal(np.asarray(rows.astype(jnp.float32)), expected)


def test_cells_of_large_maps_have_numbers_of_32_bits():
    config = lifelong(size=300, num_agents=30, max_episode_steps=40)
    pool = pj.InstancePool(config, 2, [7, 8])
    assert pool.params.pool.starts.dtype == pool.params.pool.goals.dtype == jnp.int32
    assert int(pool.params.pool.goals.max()) > 2**16
    env = VecEnv(config, 2, dtype="uint8", autoreset_mode="Disabled")
    expected, _ = env.reset(seed=[7, 8])
    state = jax.vmap(pj.reset, (None, 0))(pool.params, jnp.arange(2))
    play, see = jax.jit(jax.vmap(pj.step, (None, 0, 0))), jax.jit(jax.vmap(pj.observe, (None, 0)))
    rng = np.random.default_rng(1)
    for _ in range(39):
        np.testing.assert_array_equal(see(pool.params, state), expected)
        for name, values in env.state().items():
            if name != "obstacles":
                found = jax.vmap(pj.global_state, (None, 0))(pool.params, state)
                np.testing.assert_array_equal(getattr(found, name), values, err_msg=name)
        actions = rng.integers(5, size=(2, 30))
        expected, *_ = env.step(actions)
        state, _ = play(pool.params, state, actions)


@pytest.mark.parametrize("radius", [1, 2, 5, 15, 16, 33])
def test_packed_words_are_unpacked_as_in_numpy(radius):
    size = (2, 3, words_per_agent(radius))
    words = np.random.default_rng(radius).integers(2**32, size=size, dtype=np.uint32)
    for dtype in (np.float32, np.uint8, bool):
        actual = jax.jit(lambda words, dtype=dtype: pj.unpack(words, radius, dtype))(words)
        np.testing.assert_array_equal(actual, pogema_rs.unpack(words, radius, dtype))


@pytest.mark.parametrize("size", [5, 9])
def test_costs_to_go_are_those_of_the_encoders(size):
    config = GridConfig(size=size, num_agents=4, density=0.35, obs_radius=3, max_episode_steps=30)
    env = VecEnv(config, 8, encoder={"radius": 3, "channels": ["cost_to_go"]}, autoreset_mode="Disabled")
    expected, _ = env.reset(seed=[*range(8)])
    params = pj.InstancePool(config, 8, [*range(8)]).params
    state = jax.vmap(pj.reset, (None, 0))(params, jnp.arange(8))
    costs = jax.vmap(pj.cost_to_go, (None, 0))(params, state)
    look = jax.jit(jax.vmap(pj.cost_to_go_windows, (None, 0, 0)))
    rng = np.random.default_rng(0)
    for _ in range(30):
        np.testing.assert_array_equal(look(params, state, costs), expected[:, :, 0])
        actions = rng.integers(5, size=(8, 4))
        expected, *_ = env.step(actions)
        state, _ = jax.vmap(pj.step, (None, 0, 0))(params, state, actions)


def test_quotients_are_those_of_ieee_754():
    rng = np.random.default_rng(0)
    large = rng.integers(0, 2**29, (2, 20_000)) >> rng.integers(0, 29, (2, 20_000))
    above = np.concatenate([np.repeat(np.arange(130), 130), large[0]])
    below = np.concatenate([np.tile(np.arange(130), 130), large[1]])
    above, below = above[below > 0].astype(np.int32), below[below > 0].astype(np.int32)
    # For whole numbers below 2**29, a quotient rounded to float64 and then to float32 equals one rounded only once.
    expected = (above.astype(np.float64) / below).astype(np.float32)
    np.testing.assert_array_equal(jax.jit(jax.vmap(nearest_quotient))(above, below), expected)


def test_shared_rewards_of_constant_instances_are_exact():
    """XLA knows the number of agents at compilation, so an ordinary division would be a division by a constant."""
    agents = 41
    cells = [[0, column] for column in range(agents)]
    config = GridConfig(map="." * agents, agents_xy=cells, targets_xy=cells[:12] + cells[11:-1], obs_radius=1)
    params = pj.InstancePool(config, 1, rewards="shared").params
    first = jax.jit(lambda actions: pj.step(params, pj.reset(params, 0), actions)[1].rewards)
    np.testing.assert_array_equal(first(jnp.zeros(agents, jnp.int32)), np.full(agents, np.float32(12) / np.float32(41)))
