"""The phases of a step in their order, and the automatic start of the next episode."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from pogema_rs.jax import _collide, _goals
from pogema_rs.jax._params import Params
from pogema_rs.jax._pool import Instances
from pogema_rs.jax._state import State, reset


class Outcome(NamedTuple):
    """The results of a step, one value per agent."""

    #: Shape: `(agents,)`, float32.
    rewards: jax.Array
    #: Shape: `(agents,)`, bool.
    terminated: jax.Array
    #: Shape: `(agents,)`, bool.
    truncated: jax.Array

    @property
    def is_over(self) -> jax.Array:
        """Whether the episode is over. Shape: `()`, bool."""
        return (self.terminated | self.truncated).all(axis=-1)


def step(params: Params, instances: Instances, state: State, actions: jax.Array) -> tuple[State, Outcome]:
    """Advances an environment by one step.

    `actions` is `(agents,)`, integers from 0 to 4: stay, up, down, left, right. Compiled code cannot raise an error, so
    values outside are clipped to this range.

    Errors: ValueError or TypeError for actions of another shape or another type.

    Rule: move/actions, end/truncated, end/after

    Source: POGEMA 1.4.0, `envs.py`, `Pogema.step`, `PogemaLifeLong.step`, `PogemaCoopFinish.step`
    """
    _check(params, actions)
    actions = jnp.clip(actions, 0, 4)
    cells = _collide.moved_cells(params, state, actions)
    state = state._replace(
        cells=cells,
        occupied=_collide.marks(params, state, cells),
        on_goal=state.active & (cells == state.goals),
        num_steps=state.num_steps + 1,
    )
    outcome = Outcome(
        rewards=_goals.rewards(params, state.on_goal),
        terminated=_goals.terminated(params, state),
        truncated=jnp.broadcast_to(state.num_steps >= params.max_episode_steps, (params.num_agents,)),
    )
    return _goals.change(params, instances, state), outcome


def step_and_reset(
    params: Params, instances: Instances, state: State, actions: jax.Array, key: jax.Array
) -> tuple[State, Outcome]:
    """Advances an environment by one step; if the episode ends, the returned state begins another one.

    `key` draws the instance of the next episode from all instances, with replacement. It also works under `vmap`.

    Errors: those of `step`.
    """
    state, outcome = step(params, instances, state, actions)
    index = jax.random.randint(key, (), 0, instances.maps.shape[0])
    first = reset(params, instances, index)
    state = jax.tree.map(lambda new, old: jnp.where(outcome.is_over, new, old), first, state)
    return state, outcome


def _check(params: Params, actions: jax.Array) -> None:
    """Checks what is known before compilation."""
    if not jnp.issubdtype(actions.dtype, jnp.integer):
        raise TypeError(f"actions has type {actions.dtype}, expected integers")
    if actions.shape != (params.num_agents,):
        raise ValueError(f"actions has shape {actions.shape}, expected ({params.num_agents},)")
