"""Steps that raise for wrong actions, for debugging."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax.experimental import checkify

from pogema_rs.jax._pool import Params
from pogema_rs.jax._state import State, check_state
from pogema_rs.jax._step import NUM_ACTIONS, StepOut, check_actions, step

__all__ = ["checked_step"]


def checked_step(params: Params, state: State, actions: jax.Array) -> tuple[State, StepOut]:
    """Plays one step like `step`, but checks that every action of an agent is from 0 to 4.

    Transform it with `jax.experimental.checkify.checkify`, inside `jax.jit`. If an action is wrong, the error of the
    result names the first wrong action, and the state of the result has no meaning.

    Rule: move/invalid
    """
    check_state(params, state)
    actions = check_actions(params, actions)
    present = jnp.arange(params.config.num_agents) < state.num_agents
    is_wrong = present & ((actions < 0) | (actions >= NUM_ACTIONS))
    agent = jnp.argmax(is_wrong)
    text = "action of agent {agent} is {action}, expected 0 (stay), 1 (up), 2 (down), 3 (left) or 4 (right)"
    checkify.check(~is_wrong.any(), text, agent=agent, action=actions[agent])
    return step(params, state, actions)
