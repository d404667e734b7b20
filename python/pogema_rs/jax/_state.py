"""The state of an environment, and the reset that begins an episode."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from pogema_rs.jax._config import Config
from pogema_rs.jax._metrics import EpisodeCounts, new_counts
from pogema_rs.jax._pool import Params

__all__ = ["State", "reset"]


class State(NamedTuple):
    """The state of one environment, without its instances.

    Cells are (row, col), counted from the upper left corner of the map. The rows after the agents of an instance are
    padding, which is never active.

    Shape: `obstacles` `(rows, words)`, uint32, the map with its border as rows of bits; `cells`, `goals` and `starts`
    `(agents, 2)`, int32; `active`, `marked` (whether the cell has the agent's mark) and `on_goal` `(agents,)`, bool;
    `goal_index` `(agents,)`, int32, the index of the goal in the agent's list; `counts` as in `EpisodeCounts`; all
    others are scalars, int32

    `instance` is the slot of the instance in the arrays of the pool, which is its index until the first refill.
    `num_wraps` counts how often a list of goals began again, and `num_clipped` counts actions out of range, both since
    the reset.
    """

    obstacles: jax.Array
    cells: jax.Array
    goals: jax.Array
    starts: jax.Array
    active: jax.Array
    marked: jax.Array
    on_goal: jax.Array
    goal_index: jax.Array
    instance: jax.Array
    num_agents: jax.Array
    step: jax.Array
    num_wraps: jax.Array
    num_clipped: jax.Array
    counts: EpisodeCounts


def reset(params: Params, instance: jax.Array) -> State:
    """Begins an episode of the instance at an index, which is clamped to the pool.

    Shape: `instance` a scalar, int32; with `jax.vmap`, one for each environment

    Errors: TypeError or ValueError for arguments of another type or shape, before anything is compiled.

    Rule: goal/finish/start-on-goal, occupancy/as-released, occupancy/exact
    """
    check_params(params)
    config, pool = params.config, params.pool
    # Clamped before the cast, which would make large numbers negative.
    index = jnp.clip(check_index(instance), 0, pool.current[1] - 1).astype(jnp.int32)
    instance = pool.current[0] + index
    num_agents = pool.num_agents[instance]
    present = jnp.arange(config.num_agents) < num_agents
    cells = cell_of(config, pool.starts[instance])
    # An agent of the padding has no goals; its offset may be the end of the list.
    firsts = jnp.where(present, pool.offsets[instance, :-1], 0)
    goals = jnp.where(present[:, None], cell_of(config, pool.goals[firsts]), 0)
    return State(
        obstacles=pool.obstacles[instance],
        cells=cells,
        goals=goals,
        starts=cells,
        active=present,
        marked=present,
        on_goal=present & (cells == goals).all(-1),
        goal_index=jnp.zeros(config.num_agents, jnp.int32),
        instance=instance,
        num_agents=num_agents,
        step=jnp.int32(0),
        num_wraps=jnp.int32(0),
        num_clipped=jnp.int32(0),
        counts=new_counts(config),
    )


def check_params(params: Params) -> None:
    """Checks the type of parameters.

    Errors: TypeError for any other type.
    """
    if not isinstance(params, Params):
        kind = type(params).__name__
        raise TypeError(f"params has type {kind}, expected the `params` of an InstancePool")


def check_state(params: Params, state: State) -> None:
    """Checks the type of a state, and that its arrays have the sizes that the parameters require.

    Errors: TypeError for another type, ValueError for another size.
    """
    check_params(params)
    if not isinstance(state, State):
        raise TypeError(f"state has type {type(state).__name__}, expected a State")
    config = params.config
    expected = {"cells": (config.num_agents, 2), "obstacles": (config.grid[0], config.words)}
    for name, shape in expected.items():
        found = jnp.shape(getattr(state, name))
        if found != shape:
            raise ValueError(
                f"state.{name} has shape {found}, expected {shape} with these params; use jax.vmap for a batch"
            )


def check_index(instance: Any) -> jax.Array:
    """Returns the index of an instance as an array.

    Errors: TypeError if its type is not an integer type, ValueError if it is not a scalar.
    """
    instance = jnp.asarray(instance)
    if instance.shape != ():
        raise ValueError(f"instance has shape {instance.shape}, expected one number; use jax.vmap for a batch")
    if not jnp.issubdtype(instance.dtype, jnp.integer):
        raise TypeError(f"instance has type {instance.dtype}, expected an integer type")
    return instance


def cell_of(config: Config, numbers: jax.Array) -> jax.Array:
    """Returns the cells of the given numbers of a pool. Shape: `(...)` becomes `(..., 2)`, int32"""
    numbers = numbers.astype(jnp.int32)
    return jnp.stack([numbers // config.width, numbers % config.width], axis=-1)
