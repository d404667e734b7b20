"""Compares every step with the fast engine, for up to three agents on every map of 2 x 3 cells, with any set of
finished agents."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pogema_rs.jax as pj
import pytest
from pogema_rs import GridConfig, VecEnv

CELLS = list(itertools.product(range(2), range(3)))
RULES = list(itertools.product(("priority", "block_both", "soft"), ("1.4.0", "2.0")))


def distance(first, second):
    return abs(first[0] - second[0]) + abs(first[1] - second[1])


def situations(num_agents):
    """Returns maps, starts, finished agents and goals. If no agent has finished, goals do not matter."""
    found = []
    for obstacles in itertools.product((0, 1), repeat=len(CELLS)):
        free = [cell for cell, obstacle in zip(CELLS, obstacles) if not obstacle]
        rows = [list(obstacles[:3]), list(obstacles[3:])]
        for starts in itertools.permutations(free, num_agents):
            for gone in itertools.product((False, True), repeat=num_agents):
                if all(gone):
                    continue  # the episode has ended
                far = [max(free, key=lambda cell, start=start: distance(cell, start)) for start in starts]
                goals = [start if is_gone else goal for start, goal, is_gone in zip(starts, far, gone)]
                found.append((rows, starts, gone, goals if any(gone) else list(starts)))
    return found


def config(rows, starts, goals, collision, on_target):
    lists = {"agents_xy": [list(cell) for cell in starts], "targets_xy": [list(cell) for cell in goals]}
    return GridConfig(map=rows, obs_radius=1, collision_system=collision, on_target=on_target, **lists)


@jax.jit
def play(params, state, actions):
    def one(state):
        state, out = pj.step(params, state, actions)
        return state, out, pj.observe(params, state, jnp.uint8)

    return jax.vmap(one)(state)


@pytest.mark.parametrize("num_agents", [1, 2, 3])
@pytest.mark.parametrize(("collision", "semantics"), RULES)
@pytest.mark.parametrize("some_are_gone", [False, True])
def test_every_step_equals_that_of_the_fast_engine(num_agents, collision, semantics, some_are_gone):
    chosen = [each for each in situations(num_agents) if any(each[2]) == some_are_gone]
    if num_agents == 1 and some_are_gone:
        assert not chosen  # without its only agent, an episode has ended
        return
    on_target = "finish" if some_are_gone else "nothing"
    configs = [config(rows, starts, goals, collision, on_target) for rows, starts, _, goals in chosen]
    env = VecEnv(configs, dtype="uint8", semantics=semantics, autoreset_mode="Disabled")
    made = [pj.InstancePool(each, 1, semantics=semantics, map_size=(2, 3)) for each in configs]
    params = joined(made)
    state = jax.vmap(pj.reset, (None, 0))(params, jnp.arange(len(chosen)))
    waits = np.zeros(num_agents, dtype=np.int64)
    if some_are_gone:
        state, _, _ = play(params, state, waits)
        gone = np.array([each[2] for each in chosen])
        np.testing.assert_array_equal(state.active, ~gone)
    for actions in itertools.product(range(5), repeat=num_agents):
        env.reset(seed=0)
        if some_are_gone:
            env.step(np.zeros((len(chosen), num_agents), dtype=np.int64))
        expected, *ends, _ = env.step(np.tile(actions, (len(chosen), 1)))
        after, out, windows = play(params, state, np.array(actions))
        np.testing.assert_array_equal(windows, expected)
        for actual, values in zip(out, ends):
            np.testing.assert_array_equal(actual, values)
        for name, values in env.state().items():
            if name != "obstacles":
                actual = after.cells if name == "positions" else getattr(after, name)
                np.testing.assert_array_equal(actual, values, err_msg=name)


def joined(pools):
    """Merges pools of one instance each into params; their configs are equal and have no lifelong goals."""
    each = [pool.params for pool in pools]
    agents = each[0].config.num_agents
    arrays = pj.Pool(
        obstacles=jnp.asarray(np.concatenate([np.asarray(params.pool.obstacles) for params in each])),
        starts=jnp.asarray(np.concatenate([np.asarray(params.pool.starts) for params in each])),
        goals=jnp.asarray(np.concatenate([np.asarray(params.pool.goals)[:agents] for params in each])),
        offsets=jnp.asarray([[agents * place + agent for agent in range(agents + 1)] for place in range(len(each))]),
        num_agents=jnp.full(len(each), agents, dtype=jnp.int32),
        current=jnp.array([0, len(each)], dtype=jnp.int32),
    )
    return each[0]._replace(pool=arrays)
