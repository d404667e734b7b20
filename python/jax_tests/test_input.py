"""Tests that wrong input gives an error that names the argument, before anything is compiled."""

import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pogema_rs.jax as pj
import pytest
from jax.experimental import checkify
from pogema_rs import GridConfig
from pogema_rs.packed import words_per_agent

CONFIG = GridConfig(size=6, num_agents=3, density=0.2, obs_radius=2, max_episode_steps=8, seed=1)


@pytest.fixture(scope="module")
def pool():
    return pj.InstancePool(CONFIG, 4)


@pytest.mark.parametrize(
    ("changes", "error", "text"),
    [
        ({"num_agents": 0}, ValueError, "num_agents is 0, expected 1 to 536870911"),
        ({"height": 2.5}, TypeError, "height is 2.5, expected a whole number"),
        ({"width": True}, TypeError, "width is True, expected a whole number"),
        ({"radius": 129}, ValueError, "radius is 129, expected 1 to 128"),
        ({"collision": "sofd"}, ValueError, "collision is 'sofd', expected one of .*; did you mean `soft`"),
        ({"on_goal": "stop"}, ValueError, "on_goal is 'stop', expected one of 'finish', 'nothing', 'restart'"),
        ({"occupancy": "none"}, ValueError, "occupancy is 'none'"),
        ({"rewards": "all"}, ValueError, "rewards is 'all'"),
        ({"height": 50_000, "width": 50_000}, ValueError, "height is 50000 and width is 50000: .* 2147483647 cells"),
        ({"num_agents": 2**31}, ValueError, "num_agents is 2147483648, expected 1 to 536870911"),
    ],
)
def test_a_wrong_config_names_its_field(changes, error, text):
    fields = {"num_agents": 2, "height": 4, "width": 4, **changes}
    with pytest.raises(error, match=text):
        pj.Config(**fields)


@pytest.mark.parametrize(
    ("arguments", "error", "text"),
    [
        ({"num": 0}, ValueError, "num is 0, expected 1 to 2147483647"),
        ({"num": 2.0}, TypeError, "num is 2.0, expected a whole number"),
        ({"seeds": -1}, ValueError, "seeds is -1, expected at least 0"),
        ({"seeds": [1, 2]}, ValueError, "seeds holds 2 seeds, expected 3, one for each instance"),
        ({"seeds": [1, 2, "3"]}, TypeError, r"seeds\[2\] is '3', expected a whole number"),
        ({"seeds": [1, 2, 2**63 - 1]}, ValueError, r"seeds\[2\] is 9223372036854775807, expected 0 to .*806"),
        ({"seeds": [1, 2, 2**64]}, ValueError, r"seeds\[2\] is 18446744073709551616, expected 0 to"),
        ({"seeds": None}, TypeError, "seeds is None, expected a whole number"),
        ({"seeds": 2.0}, TypeError, "seeds is 2.0, expected a whole number"),
        ({"num_steps": -1}, ValueError, "num_steps is -1, expected 0 to"),
        ({"num_steps": 2**70}, ValueError, "num_steps is 1180591620717411303424, expected 0 to"),
        ({"num_agents": 2}, ValueError, "num_agents is 2, expected at least 3, as in the config"),
        ({"map_size": (5, 9)}, ValueError, "map_size is 5 x 9, expected at least 6 x 6, the size of the map"),
        ({"map_size": 9}, TypeError, "map_size is 9, expected a pair"),
        ({"rewards": "all"}, ValueError, "rewards is 'all', expected one of 'own', 'shared'"),
        ({"semantics": "3"}, ValueError, "semantics is '3', expected '1.4.0' or '2.0'"),
    ],
)
def test_a_wrong_argument_of_a_pool_is_named(arguments, error, text):
    with pytest.raises(error, match=text):
        pj.InstancePool(CONFIG, **{"num": 3, **arguments})


@pytest.mark.parametrize("limits", [{"max_episode_steps": 10**12}, {"size": 4, "max_episode_steps": 10**18}])
def test_a_pool_rejects_episodes_that_need_too_many_goals(limits):
    config = CONFIG.model_copy(update={"on_target": "restart", **limits})
    with pytest.raises(ValueError, match="`num_steps` is `10*`, expected fewer steps"):
        pj.InstancePool(config, 1)


def test_seeds_of_a_pool_may_be_an_iterator():
    ours, theirs = (pj.InstancePool(CONFIG, 2, seeds).params.pool for seeds in (iter([3, 4]), [3, 4]))
    jax.tree.map(np.testing.assert_array_equal, ours, theirs)


def test_a_refill_that_fails_keeps_the_instances(pool):
    before = pool.params
    with pytest.raises(ValueError, match="seeds holds 1 seed, expected 4"):
        pool.refill([1])
    assert pool.params is before


@pytest.mark.parametrize("config", [[CONFIG], "map", None])
def test_a_config_of_a_wrong_type_is_rejected(config):
    with pytest.raises(TypeError, match=f"config has type {type(config).__name__}, expected a GridConfig or a dict"):
        pj.InstancePool(config, 2)


def test_a_pool_that_does_not_fit_the_memory_is_rejected():
    with pytest.raises(MemoryError, match=r"num is 2147483647: the instances need \d+ GB of memory"):
        pj.InstancePool(CONFIG.model_copy(update={"size": 512}), 2**31 - 1)
    with pytest.raises(ValueError, match="num is 10000000000, expected 1 to 2147483647"):
        pj.InstancePool(CONFIG, 10**10)


@pytest.mark.parametrize(
    ("instance", "error", "text"),
    [
        (jnp.arange(3), ValueError, r"instance has shape \(3,\), expected one number; use jax.vmap"),
        (1.7, TypeError, "instance has type float32, expected an integer type"),
        (True, TypeError, "instance has type bool, expected an integer type"),
    ],
)
def test_a_wrong_instance_is_named(pool, instance, error, text):
    for begin in (pj.reset, jax.jit(pj.reset)):
        with pytest.raises(error, match=text):
            begin(pool.params, instance)


PARTS = [
    lambda params, state: pj.step(params, state, np.zeros(3, int)),
    lambda params, state: pj.auto_reset(params, jax.random.key(0), state, np.zeros(3, int)),
    lambda params, state: pj.checked_step(params, state, np.zeros(3, int)),
    pj.observe,
    pj.observe_rows,
    pj.global_state,
    pj.action_masks,
    pj.agents_density,
    pj.cost_to_go,
    lambda params, state: pj.cost_to_go_windows(params, state, None),
]


@pytest.mark.parametrize("part", PARTS)
def test_a_state_of_another_pool_is_named(pool, part):
    state = pj.reset(pool.params, 0)
    larger = pj.InstancePool(CONFIG, 1, map_size=(9, 40)).params
    more = pj.InstancePool(CONFIG, 1, num_agents=4).params
    states = jax.vmap(pj.reset, (None, 0))(pool.params, jnp.arange(2))
    for params, wrong, text in (
        (more, state, r"state.cells has shape \(3, 2\), expected \(4, 2\) with these params"),
        (larger, state, r"state.obstacles has shape .*, expected \(13, 3\)"),
        (pool.params, states, r"state.cells has shape \(2, 3, 2\), expected .* use jax.vmap for a batch"),
    ):
        with pytest.raises(ValueError, match=text):
            part(params, wrong)
    with pytest.raises(TypeError, match="params has type InstancePool, expected the `params` of an InstancePool"):
        part(pool, state)
    with pytest.raises(TypeError, match="state has type tuple, expected a State"):
        part(pool.params, (state, None))


def test_wrong_costs_are_named(pool):
    state = pj.reset(pool.params, 0)
    costs = pj.cost_to_go(pool.params, state)
    with pytest.raises(ValueError, match=r"costs has shape \(10, 10\), expected \(3, 10, 10\)"):
        pj.cost_to_go_windows(pool.params, state, costs[0])


def test_wrong_actions_are_errors_before_compilation(pool):
    state = pj.reset(pool.params, 0)
    step = jax.jit(pj.step)
    for actions in (np.zeros(2, int), np.zeros((3, 1), int), 0):
        with pytest.raises(ValueError, match=r"actions has shape \(.*\), expected \(3,\)"):
            step(pool.params, state, actions)
    with pytest.raises(TypeError, match="actions has type float32, expected an integer type"):
        step(pool.params, state, np.zeros(3, np.float32))


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int16, np.int32, np.int64, np.uint32])
def test_actions_of_any_integer_type_play_the_same_step(pool, dtype):
    state = pj.reset(pool.params, 0)
    expected, _ = pj.step(pool.params, state, jnp.array([1, 2, 4]))
    actual, _ = pj.step(pool.params, state, np.array([1, 2, 4], dtype))
    jax.tree.map(np.testing.assert_array_equal, actual, expected)


@pytest.mark.parametrize(("wrong", "nearest"), [(-1, 0), (5, 4), (2**31 - 1, 4), (-(2**31), 0)])
def test_actions_out_of_range_are_clipped_and_counted(pool, wrong, nearest):
    state = pj.reset(pool.params, 0)
    actual, _ = pj.step(pool.params, state, jnp.array([wrong, 0, wrong]))
    expected, _ = pj.step(pool.params, state, jnp.array([nearest, 0, nearest]))
    assert int(actual.num_clipped) == 2 and int(expected.num_clipped) == 0
    jax.tree.map(np.testing.assert_array_equal, actual._replace(num_clipped=0), expected._replace(num_clipped=0))


@pytest.mark.parametrize(("wrong", "nearest"), [(2**32 + 2, 4), (-(2**32) + 2, 0)])
def test_actions_of_64_bits_are_clipped_too(pool, wrong, nearest):
    state = pj.reset(pool.params, 0)
    actual, _ = pj.step(pool.params, state, np.array([wrong, 0, 0]))
    expected, _ = pj.step(pool.params, state, jnp.array([nearest, 0, 0]))
    assert int(actual.num_clipped) == 1
    np.testing.assert_array_equal(actual.cells, expected.cells)


def test_sizes_may_be_integers_of_numpy():
    config = pj.Config(num_agents=np.int64(2), height=np.int32(4), width=4, radius=np.int64(2))
    assert config == pj.Config(num_agents=2, height=4, width=4, radius=2) and type(config.num_agents) is int
    with pytest.raises(ValueError, match="height is 70000 and width is 70000: a grid has at most"):
        pj.Config(num_agents=1, height=np.int32(70000), width=np.int32(70000))


def test_a_pool_of_episodes_that_end_in_their_first_step():
    for limit in (-1, -5):
        pool = pj.InstancePool({"num_agents": 2, "size": 6, "max_episode_steps": limit}, 2)
        # The throughput is divided by the limit, so the pool keeps it.
        assert (pool.num_steps, int(pool.params.max_steps)) == (1, limit)


def test_checked_steps_name_the_wrong_action(pool):
    step = jax.jit(checkify.checkify(pj.checked_step))
    state = pj.reset(pool.params, 0)
    error, _ = step(pool.params, state, jnp.array([0, 7, -1]))
    with pytest.raises(checkify.JaxRuntimeError, match="action of agent 1 is 7, expected 0"):
        error.throw()
    error, _ = step(pool.params, state, jnp.array([0, 1, 2]))
    error.throw()


def test_wrong_packed_observations_are_errors():
    words = words_per_agent(2)
    with pytest.raises(TypeError, match="packed has type int32, expected uint32"):
        pj.unpack(jnp.zeros((2, words), jnp.int32), 2)
    with pytest.raises(ValueError, match=rf"packed has shape \(2, 1\), expected \(\.\.\., {words}\) at radius 2"):
        pj.unpack(jnp.zeros((2, 1), jnp.uint32), 2)
    with pytest.raises(ValueError, match="expected .*5, 1.* at radius 2"):
        pj.unpack_rows(jnp.zeros((4, 1), jnp.uint32), 2)
    for function in (pj.unpack, pj.unpack_rows):
        with pytest.raises(TypeError, match="radius is 2.5, expected a whole number"):
            function(jnp.zeros((5, 1), jnp.uint32), 2.5)
        with pytest.raises(ValueError, match="radius is 0, expected 1 to 128"):
            function(jnp.zeros((5, 1), jnp.uint32), 0)


def test_a_missing_jax_raises_a_one_line_error_that_names_the_extra():
    code = "import sys; sys.modules['jax'] = None; import pogema_rs.jax"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    last = run.stderr.strip().splitlines()[-1]
    assert run.returncode == 1 and last.startswith("ImportError: pogema_rs.jax needs JAX") and "[jax]" in last


@pytest.mark.parametrize(
    ("module", "package", "name"),
    [("jaxmarl", "jaxmarl", "JaxMARL"), ("jaxmarl", "jax", "JaxMARL"), ("gymnax", "gymnax", "gymnax")],
)
def test_a_missing_framework_raises_a_one_line_error_that_names_it(module, package, name):
    code = f"import sys; sys.modules[{package!r}] = None; import pogema_rs.integrations.{module}"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    last = run.stderr.strip().splitlines()[-1]
    assert last.startswith(f"ImportError: the {name} integration needs `pip install {module}`")


def test_the_package_imports_no_jax():
    code = "import sys, pogema_rs; pogema_rs.VecEnv; sys.exit('jax' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
