"""The observations of agents."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from pogema_rs.jax._params import Params
from pogema_rs.jax._state import State


def observe(params: Params, state: State, dtype: jnp.dtype = jnp.float32) -> jax.Array:
    """Returns the `default` observation of all agents: windows of obstacles, of agents, and of the goal.

    Shape: `(agents, 3, 2 * obs_radius + 1, 2 * obs_radius + 1)`, `dtype`, with values 0 and 1.

    Rule: observe/default, observe/default/agents, observe/default/goal, observe/default/inactive,
    observe/default/window
    """
    radius, side = params.obs_radius, params.side
    around = np.arange(-radius, radius + 1)
    offsets = jnp.asarray((around[:, None] * params.stride + around[None, :]).reshape(-1), jnp.int32)
    seen = state.cells[:, None] + offsets[None, :]
    # One gather for both grids.
    both = state.obstacles.astype(jnp.uint8) | (state.occupied.astype(jnp.uint8) << 1)
    values = both[seen]
    goals = _goal_places(params, state)[:, None] == jnp.arange(side * side, dtype=jnp.int32)[None, :]
    channels = jnp.stack([values & 1, values >> 1, goals.astype(jnp.uint8)], axis=1)
    return channels.astype(dtype).reshape(params.num_agents, 3, side, side)


def _goal_places(params: Params, state: State) -> jax.Array:
    """Returns the place of each goal in the agent's window, clamped to its rim in each axis."""
    radius = params.obs_radius
    down = state.goals // params.stride - state.cells // params.stride
    right = state.goals % params.stride - state.cells % params.stride
    down, right = jnp.clip(down, -radius, radius) + radius, jnp.clip(right, -radius, radius) + radius
    return down * params.side + right
