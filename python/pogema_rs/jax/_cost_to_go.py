"""Costs to go, which ignore other agents, and the windows of the channel `cost_to_go`."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from pogema_rs.jax._pool import Params
from pogema_rs.jax._state import State, check_state
from pogema_rs.jax._unpack import bits_of

__all__ = ["cost_to_go", "cost_to_go_windows"]


def cost_to_go(params: Params, state: State) -> jax.Array:
    """Returns the number of steps to each agent's goal from every cell of the map with its border, -1 without a path.

    Compute the numbers when goals change, and keep them: the computation takes as many rounds as the longest path has
    steps. As in the encoders, the goal itself has cost 0 even if it is an obstacle.

    Shape: `(agents, rows, columns)`, int32, with `Config.grid` rows and columns

    Errors: TypeError or ValueError for arguments of another type or shape, before anything is compiled.
    """
    check_state(params, state)
    config = params.config
    rows, columns = config.grid
    is_free = bits_of(state.obstacles, columns) == 0
    goal = state.goals + config.radius
    is_goal = (jnp.arange(rows)[:, None] == goal[:, :1, None]) & (jnp.arange(columns) == goal[:, 1:, None])

    def spread(carry: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array, jax.Array]:
        costs, front, step = carry
        around = jnp.pad(front, ((0, 0), (1, 1), (1, 1)))
        near = around[:, :-2, 1:-1] | around[:, 2:, 1:-1] | around[:, 1:-1, :-2] | around[:, 1:-1, 2:]
        front = near & is_free & (costs < 0)
        return jnp.where(front, step, costs), front, step + 1

    costs = jnp.where(is_goal, 0, -1).astype(jnp.int32)
    return jax.lax.while_loop(lambda carry: carry[1].any(), spread, (costs, is_goal, jnp.int32(1)))[0]


def cost_to_go_windows(params: Params, state: State, costs: jax.Array) -> jax.Array:
    """Returns the channel `cost_to_go` of the encoders: how much nearer to the goal each cell of a window is.

    The value is (own cost - cost) / (2 * radius), clipped to [-1, 1]; obstacles and cells without a path have -1.
    All values of an inactive agent are 0.

    Shape: `costs` as `cost_to_go` returns them; the result is `(agents, side, side)`, float32

    Errors: TypeError or ValueError for arguments of another type or shape, before anything is compiled.
    """
    check_state(params, state)
    config = params.config
    if jnp.shape(costs) != (config.num_agents, *config.grid):
        expected = (config.num_agents, *config.grid)
        raise ValueError(f"costs has shape {jnp.shape(costs)}, expected {expected}, as `cost_to_go` returns them")
    agents = jnp.arange(config.num_agents)
    offsets = jnp.arange(config.side)
    rows, columns = state.cells[:, :1] + offsets, state.cells[:, 1:] + offsets
    found = costs[agents[:, None, None], rows[:, :, None], columns[:, None, :]]
    own = found[:, config.radius, config.radius][:, None, None]
    # XLA would replace the division by a constant with an inexact multiplication, so NumPy divides.
    most = 2 * config.radius
    quotients = np.arange(-most, most + 1, dtype=np.float32) / np.float32(most)
    nearer = jnp.clip(own - found, -most, most) + most
    values = jnp.where((found < 0) | (own < 0), jnp.float32(-1), jnp.asarray(quotients)[nearer])
    return jnp.where(state.active[:, None, None], values, jnp.float32(0))
