"""Times `pogema_rs.jax`: each line of JSON on stdin names the work, and the reply on stdout is its rate per second."""

import json
import sys
import time

import jax
import jax.numpy as jnp
import numpy as np
from pogema_rs.jax import InstancePool, auto_reset, observe, observe_rows, reset, step

SECONDS = 1.0
RUNS = 3
# Steps of one compiled loop.
STEPS = 16
CONFIG = {
    "size": 32,
    "density": 0.3,
    "obs_radius": 5,
    "collision_system": "soft",
    "on_target": "nothing",
    "max_episode_steps": 10**9,
}
VIEWS = {
    "f32": observe,
    "u8": lambda params, state: observe(params, state, jnp.uint8),
    "rows": observe_rows,
}


def begin(num_envs, num_agents):
    """Returns the parameters, the first states and random actions."""
    params = InstancePool({**CONFIG, "num_agents": num_agents}, num_envs, num_steps=1).params
    states = jax.vmap(reset, (None, 0))(params, jnp.arange(num_envs))
    actions = np.random.default_rng(0).integers(0, 5, (STEPS, num_envs, num_agents), np.int32)
    return params, states, jnp.asarray(actions)


def loop(params, view):
    """Returns a function that plays a loop of steps of all environments."""

    def advance(carry, actions):
        states, _, key = carry
        if view is None:
            states, out = jax.vmap(step, (None, 0, 0))(params, states, actions)
            return (states, out.rewards, key), None
        key, draws = jax.random.split(key)
        keys = jax.random.split(draws, len(actions))
        states, _, _ = jax.vmap(auto_reset, (None, 0, 0, 0))(params, keys, states, actions)
        # The carry holds the observation, so that the compiler cannot drop it.
        return (states, jax.vmap(VIEWS[view], (None, 0))(params, states), key), None

    def play(carry, actions):
        return jax.lax.scan(advance, carry, actions)[0]

    return play


def first_seen(params, states, view):
    """Returns an array with the shape and type of the array that a step writes."""
    if view is None:
        return jnp.zeros(states.active.shape, jnp.float32)
    return jax.jit(lambda states: jax.vmap(VIEWS[view], (None, 0))(params, states))(states)


def steps(num_envs, num_agents, view):
    """Returns the batch steps per second of the fastest run; without a view, steps are not observed."""
    params, states, actions = begin(num_envs, num_agents)
    play = jax.jit(loop(params, view), donate_argnums=0)
    # Some parts of a state are the same array, and an array can be donated only once.
    states = jax.tree.map(jnp.copy, states)
    carry = play((states, first_seen(params, states, view), jax.random.key(0)), actions)
    best = 0.0
    for _ in range(RUNS):
        jax.block_until_ready(carry)
        calls, start = 0, time.perf_counter()
        while (spent := time.perf_counter() - start) < SECONDS:
            carry = jax.block_until_ready(play(carry, actions))
            calls += 1
        best = max(best, calls * STEPS / spent)
    return best


def compile_step(num_envs, num_agents):
    """Returns the compilations per second of a step with its observation."""
    params, states, actions = begin(num_envs, num_agents)
    jax.clear_caches()

    def play(states, actions):
        states, out = jax.vmap(step, (None, 0, 0))(params, states, actions)
        return states, out, jax.vmap(observe, (None, 0))(params, states)

    start = time.perf_counter()
    jax.jit(play).lower(states, actions[0]).compile()
    return 1 / (time.perf_counter() - start)


WORKS = {"steps": steps, "compile": compile_step}
for line in sys.stdin:
    name, *arguments = json.loads(line)
    print(json.dumps(WORKS[name](*arguments)), flush=True)
