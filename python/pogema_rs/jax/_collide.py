"""Conflicting moves under the three collision systems."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from pogema_rs.jax._params import Params
from pogema_rs.jax._state import State


def moved_cells(params: Params, state: State, actions: jax.Array) -> jax.Array:
    """Returns the cells of all agents after their moves.

    Rule: move/actions, move/inactive
    """
    offsets = jnp.array([0, -params.stride, params.stride, -1, 1], jnp.int32)
    targets = jnp.where(state.active, state.cells + offsets[actions], state.cells)
    moves = {"priority": _priority, "block_both": _block_both, "soft": _soft}[params.collision_system]
    return jnp.where(moves(params, state, targets) & state.active, targets, state.cells)


def marks(params: Params, state: State, cells: jax.Array) -> jax.Array:
    """Returns the occupancy grid after agents have moved to new cells.

    The agents move one after another, lowest index first. Each erases its old mark and sets the new one, so a cell that
    one agent leaves and another enters stays marked only if the index of the agent that enters it is not lower.

    Rule: occupancy/as-released, occupancy/exact
    """
    nobody = jnp.full(params.num_cells, -1, jnp.int32)
    agents = jnp.arange(params.num_agents, dtype=jnp.int32)
    old, new = _where(state.active, state.cells), _where(state.active, cells)
    leaving = nobody.at[old].set(agents, mode="drop")
    entering = nobody.at[new].set(agents, mode="drop")
    if params.exact_occupancy:
        return (entering >= 0) | (state.occupied & (leaving < 0))
    return jnp.where(entering >= 0, entering >= leaving, state.occupied & (leaving < 0))


def _where(flags: jax.Array, cells: jax.Array) -> jax.Array:
    """Returns the cells of the agents whose flag is set, and for the others an index that scatters drop."""
    return jnp.where(flags, cells, jnp.iinfo(jnp.int32).max)


def _occupants(params: Params, state: State) -> jax.Array:
    """Returns the active agent on each cell, or -1."""
    agents = jnp.arange(params.num_agents, dtype=jnp.int32)
    nobody = jnp.full(params.num_cells, -1, jnp.int32)
    return nobody.at[_where(state.active, state.cells)].set(agents, mode="drop")


def _lowest(params: Params, claims: jax.Array, targets: jax.Array) -> jax.Array:
    """Returns for each agent whether it has the lowest index of all agents that claim its target."""
    agents = jnp.arange(params.num_agents, dtype=jnp.int32)
    winners = jnp.full(params.num_cells, params.num_agents, jnp.int32)
    winners = winners.at[_where(claims, targets)].min(agents, mode="drop")
    return claims & (winners[targets] == agents)


def _along_queues(params: Params, wins: jax.Array, occupants: jax.Array) -> jax.Array:
    """Returns which agents move if each winner moves exactly if the occupant of its target does.

    `occupants` is the agent on each agent's target, or -1. Each agent points to that agent; the end of a queue points to
    itself. Doubling the pointers reaches the end of a queue of n agents after log2(n) rounds. In a ring all agents win,
    so all move.
    """
    agents = jnp.arange(params.num_agents, dtype=jnp.int32)
    ahead = jnp.where(wins & (occupants >= 0), occupants, agents)
    num_rounds = (params.num_agents - 1).bit_length()
    ahead = jax.lax.fori_loop(0, num_rounds, lambda _, ahead: ahead[ahead], ahead)
    return wins[ahead]


def _priority(params: Params, state: State, targets: jax.Array) -> jax.Array:
    """Moves one agent after another, lowest index first, onto any cell that is unoccupied at that moment.

    Only an agent with a higher index than the occupant can find the occupant gone.

    Rule: collide/priority, collide/priority/contest, collide/priority/follow, collide/priority/swap
    """
    agents = jnp.arange(params.num_agents, dtype=jnp.int32)
    occupants = _occupants(params, state)[targets]
    claims = state.active & ~state.obstacles[targets] & (occupants < agents)
    return _along_queues(params, _lowest(params, claims, targets), occupants)


def _block_both(params: Params, state: State, targets: jax.Array) -> jax.Array:
    """Moves agents onto cells that were unoccupied before the step and that no other agent requests.

    Rule: collide/block-both, collide/block-both/contest, collide/block-both/occupied
    """
    counts = jnp.zeros(params.num_cells, jnp.int32).at[_where(state.active, targets)].add(1, mode="drop")
    return ~state.obstacles[targets] & ~state.occupied[targets] & (counts[targets] == 1)


def _soft(params: Params, state: State, targets: jax.Array) -> jax.Array:
    """Moves all agents simultaneously, and reverts only impossible moves.

    Rule: collide/soft, collide/soft/stay, collide/soft/swap, collide/soft/contest, collide/soft/chain
    """
    occupants = _occupants(params, state)[targets]
    # A waiting agent swaps with itself.
    swaps = (occupants >= 0) & (targets[occupants] == state.cells)
    claims = state.active & ~state.obstacles[targets] & ~swaps
    return _along_queues(params, _lowest(params, claims, targets), occupants)
