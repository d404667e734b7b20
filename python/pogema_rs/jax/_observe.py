"""The observations of agents, from rows of bits."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from pogema_rs.jax._collide import MOVES
from pogema_rs.jax._config import Config
from pogema_rs.jax._pool import Params
from pogema_rs.jax._state import State, check_state
from pogema_rs.jax._unpack import bits_of, unpack_rows

__all__ = ["GlobalState", "action_masks", "global_state", "marks", "observe", "observe_rows"]


BITS = 32


class GlobalState(NamedTuple):
    """The state that a centralised critic sees, as `VecEnv.state()` returns it, except for cells outside smaller maps.

    Shape: `obstacles` `(height, width)`, uint8; `positions` and `goals` `(agents, 2)`, int32; `active` `(agents,)`,
    bool
    """

    obstacles: jax.Array
    positions: jax.Array
    goals: jax.Array
    active: jax.Array


def observe(params: Params, state: State, dtype: Any = jnp.float32) -> jax.Array:
    """Returns the `default` observation of all agents, finished ones included; that of padding is 0.

    Shape: `(agents, 3, side, side)` of `dtype`, with every value 0 or 1: obstacles, agents, goal

    Errors: TypeError or ValueError for arguments of another type or size, before anything is compiled.

    Rule: observe/default, observe/default/agents, observe/default/inactive
    """
    return unpack_rows(observe_rows(params, state), params.config.radius, dtype)


def observe_rows(params: Params, state: State) -> jax.Array:
    """Returns the `default` observation as rows of bits; the first column is the lowest bit of the first word.

    Shape: `(agents, 3, side, words)`, uint32, where words is `Config.window_words`

    Errors: TypeError or ValueError for arguments of another type or size, before anything is compiled.

    Rule: observe/default, observe/default/window, observe/default/agents, observe/default/goal
    """
    check_state(params, state)
    config = params.config
    present = jnp.arange(config.num_agents) < state.num_agents
    goals = _goal_rows(config, state, present)
    if _has_table(config):
        both = jnp.where(present[:, None, None], _both_windows(config, state), jnp.uint32(0))[:, None]
        layer = jnp.arange(3)[:, None, None]
        # One expression for all layers is faster on a CPU than three arrays that are then joined.
        windows = jnp.where(layer < 2, both >> jnp.where(layer == 1, BITS // 2, 0).astype(jnp.uint32), goals[:, None])
        return windows & _last_mask(config)
    obstacles = _windows(config, state.obstacles, state.cells)
    agents = _windows(config, marks(config, state), state.cells)
    windows = jnp.stack([obstacles, agents, goals], axis=1)
    return jnp.where(present[:, None, None, None], windows, jnp.uint32(0))


def marks(config: Config, state: State) -> jax.Array:
    """Returns the occupancy grid as rows of bits, with the border.

    Shape: `(rows, words)`, uint32

    Rule: occupancy/as-released, occupancy/exact
    """
    row, column = state.cells[:, 0] + config.radius, state.cells[:, 1] + config.radius
    bits = jnp.where(state.active & state.marked, jnp.uint32(1) << (column & 31).astype(jnp.uint32), jnp.uint32(0))
    # Active agents are on different cells, so adding bits sets them.
    return jnp.zeros((config.grid[0], config.words), jnp.uint32).at[row, column >> 5].add(bits)


def global_state(params: Params, state: State) -> GlobalState:
    """Returns the map without its border, and the cells, goals and flags of all agents.

    Beyond the rows and columns of a smaller map, `obstacles` holds its wall and the area outside. No agent can
    enter these cells.

    Errors: TypeError or ValueError for arguments of another type or shape, before anything is compiled.
    """
    check_state(params, state)
    config = params.config
    grid = bits_of(state.obstacles, config.grid[1]).astype(jnp.uint8)
    inner = slice(config.radius, config.radius + config.height), slice(config.radius, config.radius + config.width)
    return GlobalState(grid[inner], state.cells, state.goals, state.active)


def action_masks(params: Params, state: State) -> jax.Array:
    """Returns the actions that no obstacle blocks now, as `VecEnv.action_masks` does.

    Shape: `(agents, 5)`, bool; an inactive agent and padding can only stay

    Errors: TypeError or ValueError for arguments of another type or size, before anything is compiled.

    Rule: move/actions
    """
    check_state(params, state)
    cells = state.cells[:, None] + params.config.radius + jnp.array(MOVES)
    row, column = cells[..., 0], cells[..., 1]
    blocked = (state.obstacles[row, column >> 5] >> (column & 31).astype(jnp.uint32)) & 1
    return jnp.where(state.active[:, None], blocked == 0, jnp.arange(len(MOVES)) == 0)


def _windows(config: Config, grid: jax.Array, cells: jax.Array) -> jax.Array:
    """Returns the part of a grid around each agent as rows of bits. Shape: `(agents, side, words)`, uint32

    Rule: observe/default/window
    """
    rows = cells[:, :1] + jnp.arange(config.side)
    word, shift = cells[:, 1] >> 5, (cells[:, 1] & 31).astype(jnp.uint32)[:, None, None]
    num_words = config.window_words
    columns = word[:, None] + jnp.arange(num_words + 1)
    # Every row of the grid has one word more than its cells need, so all words are inside.
    found = grid.at[rows[:, :, None], columns[:, None, :]].get(mode="promise_in_bounds")
    low, high = found[..., :-1] >> shift, (found[..., 1:] << 1) << (31 - shift)
    return (low | high) & _last_mask(config)


def _has_table(config: Config) -> bool:
    """Returns whether observations come from a table: rows of two layers fit a word, and the table costs less than
    separate rows of windows."""
    return config.side <= BITS // 2 and config.grid[0] * config.width <= 4 * config.num_agents * config.side


def _both_windows(config: Config, state: State) -> jax.Array:
    """Returns the obstacles around each agent in the low half of each word, and the agents in the high half.

    Shape: `(agents, side, 1)`, uint32

    Rule: observe/default/window
    """
    table = _rows_from(config, state.obstacles) | (_rows_from(config, marks(config, state)) << (BITS // 2))
    rows = state.cells[:, :1] + jnp.arange(config.side)
    return table.at[rows, state.cells[:, 1:]].get(mode="promise_in_bounds")[..., None]


def _rows_from(config: Config, grid: jax.Array) -> jax.Array:
    """Returns, for each cell of a grid, a row of a window that begins there. Shape: `(rows, columns)`, uint32"""
    num_words, shift = -(-config.width // BITS), jnp.arange(BITS, dtype=jnp.uint32)
    low, high = grid[:, :num_words, None], grid[:, 1 : num_words + 1, None]
    rows = (low >> shift) | ((high << 1) << (BITS - 1 - shift))
    return rows.reshape(grid.shape[0], num_words * BITS) & _last_mask(config)


def _last_mask(config: Config) -> jax.Array:
    """Returns a mask for each word of a window's row: the bits that are columns of the window."""
    ends = [min(32, config.side - 32 * word) for word in range(config.window_words)]
    return jnp.array([(1 << end) - 1 for end in ends], dtype=jnp.uint32)


def _goal_rows(config: Config, state: State, present: jax.Array) -> jax.Array:
    """Returns a single 1 for the goal of each present agent, clamped to the rim of the window, as rows of bits.

    Rule: observe/default/goal
    """
    radius = config.radius
    down, right = (jnp.clip(state.goals - state.cells, -radius, radius) + radius).T
    down = jnp.where(present, down, -1)
    is_row = down[:, None, None] == jnp.arange(config.side)[:, None]
    is_word = (right >> 5)[:, None, None] == jnp.arange(config.window_words)
    bit = jnp.uint32(1) << (right & 31).astype(jnp.uint32)
    return jnp.where(is_row & is_word, bit[:, None, None], jnp.uint32(0))
