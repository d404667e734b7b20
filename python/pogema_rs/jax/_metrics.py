"""The metrics of an episode, counted step by step."""

from __future__ import annotations

from typing import Any, NamedTuple, Optional

import jax
import jax.numpy as jnp
import numpy as np

from pogema_rs.jax._config import Config

__all__ = ["EpisodeCounts", "exact_metrics", "feed", "metrics", "new_counts"]

# A number larger than any step.
NEVER = 2**31 - 1


class EpisodeCounts(NamedTuple):
    """The counts from which the metrics are computed, as integers, so that none is rounded.

    `step` is the index of the last step, counted from 0, or -1 before the first step. `arrived` is the step of each
    agent's arrival, or `NEVER` before it; agents that have not arrived when the episode ends get its last step. After a
    step that ended the episode, `is_new` is True and the next step has index 0. `collisions` counts the moves that
    agents and obstacles prevented since the reset.

    Shape: scalars, int32, but `arrived` `(agents,)`, int32; `is_new` a scalar, bool; `collisions` `(2,)`, int32
    """

    step: jax.Array
    num_reached: jax.Array
    num_on_goal: jax.Array
    arrived: jax.Array
    is_new: jax.Array
    collisions: jax.Array


def new_counts(config: Config) -> EpisodeCounts:
    """Returns the counts of an episode without steps."""
    zero = jnp.int32(0)
    arrived = jnp.full(config.num_agents, NEVER, jnp.int32)
    return EpisodeCounts(jnp.int32(-1), zero, zero, arrived, jnp.bool_(True), jnp.zeros(2, jnp.int32))


def feed(
    config: Config, counts: EpisodeCounts, on_goal: jax.Array, ended: jax.Array, collisions: jax.Array
) -> EpisodeCounts:
    """Counts one step; `ended` says whether it ends the episode.

    Rule: metrics/finish, metrics/nothing, metrics/restart, metrics/collisions
    """
    step = jnp.where(counts.is_new, 0, counts.step + 1)
    arrived = jnp.where(counts.is_new, NEVER, counts.arrived)
    num_on_goal = on_goal.sum(dtype=jnp.int32)
    now = jnp.minimum(arrived, jnp.where(on_goal | ended, step, NEVER))
    if config.on_goal == "nothing":
        # An agent that leaves its goal before the last step loses its arrival.
        now = jnp.where(~on_goal & ~ended, NEVER, now)
    reached = jnp.where(counts.is_new, 0, counts.num_reached) + num_on_goal
    return EpisodeCounts(step, reached, num_on_goal, now, ended, counts.collisions + collisions)


def metrics(config: Config, counts: EpisodeCounts, num_agents: jax.Array, max_steps: jax.Array) -> dict[str, jax.Array]:
    """Returns the metrics of the episode that the last step ended, as float32.

    If the last step did not end an episode, they have no meaning.

    Rule: metrics/finish, metrics/nothing, metrics/restart
    """
    found = _formulas(jnp, jnp.float32, config, counts, num_agents, max_steps)
    return {name: jnp.asarray(value, jnp.float32) for name, value in found.items()}


def exact_metrics(config: Config, counts: EpisodeCounts, num_agents: int, max_steps: int) -> Optional[dict[str, float]]:
    """Returns the metrics of the episode that the last step ended, computed on the host as float64, or None.

    Rule: metrics/finish, metrics/nothing, metrics/restart
    """
    if not counts.is_new or int(counts.step) < 0:
        return None
    counts = jax.tree.map(np.asarray, counts)
    found = _formulas(np, np.float64, config, counts, np.int64(num_agents), np.int64(max_steps))
    return {name: float(value) for name, value in found.items()}


def _formulas(
    xp: Any, dtype: Any, config: Config, counts: EpisodeCounts, num_agents: Any, max_steps: Any
) -> dict[str, Any]:
    agents, reached = num_agents.astype(dtype), counts.num_reached.astype(dtype)
    present = xp.arange(config.num_agents) < num_agents
    total = xp.where(present, counts.arrived, 0).astype(dtype).sum()
    if config.on_goal == "finish":
        csr = (counts.num_reached == num_agents).astype(dtype)
        return {"ISR": reached / agents, "CSR": csr, "ep_length": total / agents + 1}
    if config.on_goal == "nothing":
        return {
            "ISR": counts.num_on_goal.astype(dtype) / agents,
            "CSR": (counts.num_on_goal == num_agents).astype(dtype),
            "ep_length": counts.step.astype(dtype) + 1,
            "SoC": total + agents,
            "makespan": xp.where(present, counts.arrived, 0).max().astype(dtype) + 1,
        }
    return {"avg_throughput": reached / max_steps.astype(dtype)}
