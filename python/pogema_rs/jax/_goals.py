"""The effects of reaching a goal: rewards, ends and next goals."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from pogema_rs.jax._config import Config
from pogema_rs.jax._division import nearest_quotient
from pogema_rs.jax._pool import Params
from pogema_rs.jax._state import State, cell_of

__all__ = ["advance_goals", "pay", "terminate", "truncate"]


class Advanced(NamedTuple):
    """Goals after a step. Shape: `goals` `(agents, 2)`, `goal_index` `(agents,)`, `num_wraps` a scalar; int32"""

    goals: jax.Array
    goal_index: jax.Array
    num_wraps: jax.Array


def all_on_goal(state: State) -> jax.Array:
    """Returns whether all agents are on their goals. Rule: goal/nothing"""
    return state.on_goal.sum() == state.num_agents


def pay(config: Config, state: State) -> jax.Array:
    """Returns the reward of each agent; that of padding is 0.

    Shape: `(agents,)`, float32

    Rule: reward/own, reward/shared
    """
    present = jnp.arange(config.num_agents) < state.num_agents
    if config.rewards == "shared":
        share = nearest_quotient(state.on_goal.sum(dtype=jnp.int32), state.num_agents)
        return jnp.where(present, share, jnp.float32(0))
    paid = all_on_goal(state) & present if config.on_goal == "nothing" else state.on_goal
    return paid.astype(jnp.float32)


def terminate(config: Config, state: State) -> jax.Array:
    """Returns which agents are terminated; padding counts as terminated.

    Shape: `(agents,)`, bool

    Rule: end/terminated
    """
    if config.on_goal == "finish":
        # A finished agent stays on its goal, so it stays terminated.
        ended = (state.cells == state.goals).all(-1)
    elif config.on_goal == "nothing":
        ended = jnp.full(config.num_agents, all_on_goal(state))
    else:
        ended = jnp.zeros(config.num_agents, bool)
    return ended | (jnp.arange(config.num_agents) >= state.num_agents)


def truncate(params: Params, state: State) -> jax.Array:
    """Returns which agents are truncated; padding counts as truncated.

    Shape: `(agents,)`, bool

    Rule: end/truncated, end/after
    """
    return (state.step >= params.max_steps) | (jnp.arange(params.config.num_agents) >= state.num_agents)


def advance_goals(params: Params, state: State) -> Advanced:
    """Returns the goals after each agent on its goal has received its next goal.

    After the last goal of a list, the first is next.

    Rule: goal/restart, goal/restart/next, goal/restart/sequence
    """
    config, pool = params.config, params.pool
    firsts, ends = pool.offsets[state.instance, :-1], pool.offsets[state.instance, 1:]
    index = state.goal_index + state.on_goal
    wraps = state.on_goal & (index >= ends - firsts)
    index = jnp.where(wraps, 0, index)
    # An agent that is not on its goal keeps its goal. The index does not determine it, because a step back restores
    # the goal, but not the index.
    found = cell_of(config, pool.goals.at[firsts + index].get(mode="clip"))
    goals = jnp.where(state.on_goal[:, None], found, state.goals)
    return Advanced(goals, index, state.num_wraps + wraps.sum(dtype=jnp.int32))
