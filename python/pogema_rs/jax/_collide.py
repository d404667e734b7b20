"""Conflicting moves under the three collision systems."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from pogema_rs.jax._config import Config
from pogema_rs.jax._state import State

__all__ = ["Moved", "move_agents"]

# Row and column of stay, up, down, left, right.
MOVES = np.array([[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]], dtype=np.int32)


class Moved(NamedTuple):
    """The cells after the moves; which agents have their marks, which moved, and which an obstacle blocked.

    Shape: `cells` `(agents, 2)`, int32; `marked`, `moves` and `is_blocked` `(agents,)`, bool
    """

    cells: jax.Array
    marked: jax.Array
    moves: jax.Array
    is_blocked: jax.Array


class Aims(NamedTuple):
    """The cell and the target of each agent, as indices of grid cells.

    Inactive agents have the index after the last cell. For each cell, `board` holds the active agent on it, or the
    number of agents if no active agent is on it. `occupant` is the value of `board` at the target. `is_blocked`:
    whether the target is an obstacle.

    Shape: `(agents,)` each; `board` `(cells,)`
    """

    here: jax.Array
    there: jax.Array
    occupant: jax.Array
    is_blocked: jax.Array
    board: jax.Array


def move_agents(config: Config, state: State, actions: jax.Array) -> Moved:
    """Moves the active agents by their actions, as far as the collision system allows.

    Shape: `actions` `(agents,)`, 0 to 4

    Rule: move/actions, move/inactive
    """
    aimed = state.cells + jnp.asarray(MOVES)[actions]
    aims = _aims(config, state, aimed)
    resolve = {"priority": _by_priority, "block_both": _blocking_both, "soft": _softly}[config.collision]
    moves = resolve(config, state, aims)
    cells = jnp.where(moves[:, None], aimed, state.cells)
    is_lost = _lost_marks(config, aims, moves) if _loses_marks(config) else jnp.zeros_like(moves)
    return Moved(cells, state.active & ~is_lost, moves, aims.is_blocked)


def _aims(config: Config, state: State, aimed: jax.Array) -> Aims:
    rows, columns = config.grid
    num_cells = rows * columns

    def number(cells: jax.Array) -> jax.Array:
        shifted = cells + config.radius
        return jnp.where(state.active, shifted[:, 0] * columns + shifted[:, 1], num_cells)

    here, there = number(state.cells), number(aimed)
    agents = jnp.arange(config.num_agents, dtype=jnp.int32)
    board = jnp.full(num_cells, config.num_agents, jnp.int32).at[here].set(agents, mode="drop")
    row, column = aimed[:, 0] + config.radius, aimed[:, 1] + config.radius
    bits = state.obstacles[row, column >> 5] >> (column & 31).astype(jnp.uint32)
    return Aims(here, there, board.at[there].get(mode="clip"), (bits & 1) == 1, board)


def _lowest(config: Config, aims: Aims, claims: jax.Array) -> jax.Array:
    """Returns which of the claiming agents have the lowest index among those that claim the same cell."""
    agents = jnp.arange(config.num_agents, dtype=jnp.int32)
    num_cells = aims.board.shape[0]
    claimed = jnp.where(claims, aims.there, num_cells)
    first = jnp.full(num_cells, config.num_agents, jnp.int32).at[claimed].min(agents, mode="drop")
    return claims & (first.at[aims.there].get(mode="clip") == agents)


def _follow(config: Config, aims: Aims, wins: jax.Array) -> jax.Array:
    """Returns which winners move: those whose queue ends with a winner, and those in rings.

    A queue leads from each winner to the agent on the cell that it won. The last agent of a queue points to itself, so
    that ⌈log2 agents⌉ doublings of the pointers reach the end from anywhere. All agents between a winner and the end
    are winners.
    """
    agents = jnp.arange(config.num_agents, dtype=jnp.int32)
    ahead = jnp.where(wins & (aims.occupant < config.num_agents), aims.occupant, agents)
    num_hops = (config.num_agents - 1).bit_length()
    ahead = jax.lax.fori_loop(0, num_hops, lambda _, pointer: pointer[pointer], ahead)
    return wins & wins[ahead]


def _softly(config: Config, state: State, aims: Aims) -> jax.Array:
    """Moves all agents simultaneously, and reverts only impossible moves.

    Rule: collide/soft, collide/soft/stay, collide/soft/swap, collide/soft/contest, collide/soft/chain
    """
    # If no agent occupies the target, the entry is -1, which equals no cell. An agent that stays counts as a swap with
    # itself.
    target_of_occupant = aims.there.at[aims.occupant].get(mode="fill", fill_value=-1)
    claims = state.active & ~aims.is_blocked & (target_of_occupant != aims.here)
    return _follow(config, aims, _lowest(config, aims, claims))


def _by_priority(config: Config, state: State, aims: Aims) -> jax.Array:
    """Moves one agent after another, lowest index first, onto any cell that is unoccupied at that moment.

    The parallel form is exact. If an agent has a lower index than the occupant, its turn comes before the occupant can
    leave, so that agent stays. Of the others, the agent with the lowest index claims the cell first. If the occupant
    has left, this agent enters; if not, no agent enters.

    Rule: collide/priority, collide/priority/contest, collide/priority/follow, collide/priority/swap
    """
    agents = jnp.arange(config.num_agents, dtype=jnp.int32)
    is_unoccupied = aims.occupant == config.num_agents
    claims = state.active & ~aims.is_blocked & (is_unoccupied | (aims.occupant < agents))
    return _follow(config, aims, _lowest(config, aims, claims))


def _blocking_both(config: Config, state: State, aims: Aims) -> jax.Array:
    """Moves agents onto cells that were unoccupied before the step and that no other agent requests.

    Rule: collide/block-both, collide/block-both/contest, collide/block-both/occupied
    """
    contenders = jnp.zeros_like(aims.board).at[aims.there].add(1, mode="drop")
    is_alone = contenders.at[aims.there].get(mode="clip") == 1
    return state.active & ~aims.is_blocked & (aims.occupant == config.num_agents) & is_alone


def _loses_marks(config: Config) -> bool:
    return config.collision == "soft" and config.occupancy == "as_released"


def _lost_marks(config: Config, aims: Aims, moves: jax.Array) -> jax.Array:
    """Returns which agents entered a cell that an agent with a higher index left in the same step.

    The agent with the higher index clears the cell after the other agent marked it.

    Rule: occupancy/as-released
    """
    agents = jnp.arange(config.num_agents, dtype=jnp.int32)
    return moves & (aims.occupant < config.num_agents) & (aims.occupant > agents)
