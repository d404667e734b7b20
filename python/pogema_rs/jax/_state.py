"""The state of an environment, and its beginning."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from pogema_rs.jax._params import Params
from pogema_rs.jax._pool import Instances


class State(NamedTuple):
    """The state of one environment, as a pytree. `jax.vmap` adds an axis for environments.

    A cell is its index in the map with its border, row by row. `goal_index` is the place of an agent's goal in
    `Instances.goals`; `goal_begin` is the place of its first goal, and `goal_end` the place after its last.
    """

    #: Shape: `(cells,)`, bool: obstacles of the map and its border.
    obstacles: jax.Array
    #: Shape: `(cells,)`, bool: the cells where observations show an agent.
    occupied: jax.Array
    #: Shape: `(agents,)`, int32.
    cells: jax.Array
    #: Shape: `(agents,)`, int32.
    goals: jax.Array
    #: Shape: `(agents,)`, bool: False for agents that have finished.
    active: jax.Array
    #: Shape: `(agents,)`, bool: the agents that are on their goals and active.
    on_goal: jax.Array
    #: Shape: `(agents,)`, int32.
    goal_index: jax.Array
    #: Shape: `(agents,)`, int32.
    goal_begin: jax.Array
    #: Shape: `(agents,)`, int32.
    goal_end: jax.Array
    #: Shape: `()`, int32: number of steps of the episode.
    num_steps: jax.Array
    #: Shape: `()`, int32: how often an agent has reached its last goal, after which its list begins again.
    num_wraps: jax.Array


def reset(params: Params, instances: Instances, index: jax.Array | int) -> State:
    """Returns the first state of an episode of the instance at an index.

    Rule: goal/finish/start-on-goal, occupancy/as-released, occupancy/exact
    """
    rows = jnp.unpackbits(instances.maps[index], axis=-1, count=params.stride)
    cells = instances.starts[index].astype(jnp.int32)
    ends = instances.ends[index]
    first = jnp.concatenate([instances.begin[index][None], ends[:-1]])
    goals = instances.goals[first].astype(jnp.int32)
    return State(
        obstacles=rows.reshape(-1).astype(jnp.bool_),
        occupied=jnp.zeros(params.num_cells, jnp.bool_).at[cells].set(True),
        cells=cells,
        goals=goals,
        active=jnp.ones(params.num_agents, jnp.bool_),
        on_goal=cells == goals,
        goal_index=first,
        goal_begin=first,
        goal_end=ends,
        num_steps=jnp.int32(0),
        num_wraps=jnp.int32(0),
    )
