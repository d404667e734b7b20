"""The density of agents in their windows."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from pogema_rs.jax._observe import observe_rows
from pogema_rs.jax._pool import Params
from pogema_rs.jax._state import State

__all__ = ["agents_density", "density_counts"]


def agents_density(params: Params, state: State) -> jax.Array:
    """Returns the share of the free cells of an agent's window that agents occupy, averaged over the agents.

    The metric `avg_agents_density` is the mean of these numbers over the states of an episode, the first one
    included. `step` does not sum them, because that would need the windows of every step.

    Shape: a scalar, float32

    Errors: TypeError or ValueError for arguments of another type or size, before anything is compiled.

    Rule: metrics/density
    """
    counts = density_counts(params, state).astype(jnp.float32)
    # A window without a free cell counts as 0, and so does that of padding.
    shares = jnp.where(counts[:, 1] == 0, 0, counts[:, 0] / jnp.maximum(counts[:, 1], 1))
    return shares.sum() / state.num_agents.astype(jnp.float32)


def density_counts(params: Params, state: State) -> jax.Array:
    """Returns the number of occupied cells and the number of free cells in the window of each agent.

    Shape: `(agents, 2)`, int32; 0 for padding

    Rule: metrics/density
    """
    config = params.config
    rows = observe_rows(params, state)[:, :2]
    obstacles, agents = jax.lax.population_count(rows).astype(jnp.int32).sum(axis=(-1, -2)).T
    present = jnp.arange(config.num_agents) < state.num_agents
    free = jnp.where(present, config.side**2 - obstacles, 0)
    return jnp.stack([agents, free], axis=-1)
