"""The order of the phases in a step, and the reset after an episode ends."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from pogema_rs.jax._collide import MOVES, move_agents
from pogema_rs.jax._goals import advance_goals, pay, terminate, truncate
from pogema_rs.jax._metrics import feed
from pogema_rs.jax._pool import Params, draw_instance
from pogema_rs.jax._state import State, check_state, reset

__all__ = ["StepOut", "auto_reset", "step"]

NUM_ACTIONS = len(MOVES)


class StepOut(NamedTuple):
    """The results of a step. Padding has rewards of 0 and is terminated and truncated.

    Shape: `rewards` `(agents,)`, float32; `terminated` and `truncated` `(agents,)`, bool; `ended`, whether the episode
    has ended, a scalar, bool
    """

    rewards: jax.Array
    terminated: jax.Array
    truncated: jax.Array
    ended: jax.Array


def step(params: Params, state: State, actions: jax.Array) -> tuple[State, StepOut]:
    """Plays one step of one environment. Steps after the end of an episode follow the same rules.

    An action outside 0 to 4 is clipped, and `State.num_clipped` counts it; `checked_step` raises instead. Without
    `jax_enable_x64`, `jax.jit` keeps only the lower 32 bits of an int64 action before this function sees it.

    Shape: `actions` `(agents,)`, integers from 0 to 4

    Errors: TypeError or ValueError for arguments of another type or shape, before anything is compiled.

    Rule: move/actions, move/inactive, end/after
    """
    check_state(params, state)
    config = params.config
    actions = check_actions(params, actions)
    present = jnp.arange(config.num_agents) < state.num_agents
    clipped = jnp.clip(actions, 0, NUM_ACTIONS - 1).astype(jnp.int32)
    num_clipped = state.num_clipped + (present & (actions != clipped)).sum(dtype=jnp.int32)
    moved = move_agents(config, state, clipped)
    reverted = state.active & (clipped != 0) & ~moved.moves
    on_goal = state.active & (moved.cells == state.goals).all(-1)
    state = state._replace(
        step=state.step + 1, cells=moved.cells, marked=moved.marked, on_goal=on_goal, num_clipped=num_clipped
    )
    rewards, terminated, truncated = pay(config, state), terminate(config, state), truncate(params, state)
    ended = terminated.all() | truncated.all()
    by = jnp.stack([reverted & ~moved.is_blocked, reverted & moved.is_blocked]).sum(-1, dtype=jnp.int32)
    state = state._replace(counts=feed(config, state.counts, on_goal, ended, by))
    return change_goals(params, state), StepOut(rewards, terminated, truncated, ended)


def change_goals(params: Params, state: State) -> State:
    """Lets the agents on their goals leave the map or get their next goals.

    Rule: goal/finish/leave, goal/nothing, goal/restart/next
    """
    if params.config.on_goal == "finish":
        return state._replace(active=state.active & ~state.on_goal, marked=state.marked & ~state.on_goal)
    if params.config.on_goal == "restart":
        goals, goal_index, num_wraps = advance_goals(params, state)
        return state._replace(goals=goals, goal_index=goal_index, num_wraps=num_wraps)
    return state


def auto_reset(params: Params, key: jax.Array, state: State, actions: jax.Array) -> tuple[State, StepOut, State]:
    """Plays one step; if it ended the episode, begins an episode of an instance that is drawn with the key.

    Returns the state to continue with, the results of the step, and the state before the reset, for its observation
    and metrics.
    """
    last, out = step(params, state, actions)
    first = reset(params, draw_instance(params, key))
    return jax.tree.map(lambda new, old: jnp.where(out.ended, new, old), first, last), out, last


def check_actions(params: Params, actions: jax.Array) -> jax.Array:
    """Returns actions as an array of integers of the right shape."""
    if isinstance(actions, np.ndarray) and np.issubdtype(actions.dtype, np.integer):
        # Without x64, JAX would keep the lower 32 bits of a wrong action, which may be those of a right one.
        kind, room = np.iinfo(actions.dtype), np.iinfo(np.int32)
        actions = np.clip(actions, max(kind.min, room.min), min(kind.max, room.max))
    actions = jnp.asarray(actions)
    expected = (params.config.num_agents,)
    if actions.shape != expected:
        raise ValueError(f"actions has shape {actions.shape}, expected {expected}; use jax.vmap for a batch")
    if not jnp.issubdtype(actions.dtype, jnp.integer):
        raise TypeError(f"actions has type {actions.dtype}, expected an integer type")
    return actions
