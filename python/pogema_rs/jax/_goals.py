"""The effects of reaching a goal: rewards, ends and next goals."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from pogema_rs.jax._params import Params
from pogema_rs.jax._pool import Instances
from pogema_rs.jax._state import State


def rewards(params: Params, on_goal: jax.Array) -> jax.Array:
    """Returns the reward of each agent. Shape: `(agents,)`, float32

    Rule: reward/own, reward/shared
    """
    if params.shared_rewards:
        # A table, because a compiler may multiply by the inverse in place of dividing.
        shares = np.arange(params.num_agents + 1, dtype=np.float32) / np.float32(params.num_agents)
        return jnp.broadcast_to(jnp.asarray(shares)[on_goal.sum()], on_goal.shape)
    if params.on_target == "nothing":
        return jnp.broadcast_to(on_goal.all(), on_goal.shape).astype(jnp.float32)
    return on_goal.astype(jnp.float32)


def terminated(params: Params, state: State) -> jax.Array:
    """Returns which agents are terminated. Shape: `(agents,)`, bool

    Rule: end/terminated
    """
    if params.on_target == "finish":
        return state.cells == state.goals
    if params.on_target == "nothing":
        return jnp.broadcast_to(state.on_goal.all(), state.on_goal.shape)
    return jnp.zeros_like(state.on_goal)


def change(params: Params, instances: Instances, state: State) -> State:
    """Lets the agents on their goals leave the map or get their next goals.

    Rule: goal/finish/leave, goal/nothing, goal/restart/next
    """
    if params.on_target == "nothing":
        return state
    if params.on_target == "finish":
        left = jnp.where(state.on_goal, state.cells, jnp.iinfo(jnp.int32).max)
        occupied = state.occupied.at[left].set(False, mode="drop")
        return state._replace(occupied=occupied, active=state.active & ~state.on_goal)
    has_next = state.goal_index + 1 < state.goal_end
    later = jnp.where(has_next, state.goal_index + 1, state.goal_begin)
    index = jnp.where(state.on_goal, later, state.goal_index)
    return state._replace(
        goal_index=index,
        goals=instances.goals[index].astype(jnp.int32),
        num_wraps=state.num_wraps + (state.on_goal & ~has_next).sum(dtype=jnp.int32),
    )
