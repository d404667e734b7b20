"""Environments of one agent for gymnax, played by `pogema_rs.jax`."""

from __future__ import annotations

from typing import Any, Optional

try:
    import jax
    from gymnax.environments.environment import Environment
    from gymnax.environments.spaces import Box, Discrete
except ImportError as missing:
    raise ImportError("the gymnax integration needs `pip install gymnax`, 1.0 or later") from missing

from pogema_rs.jax import InstancePool, Params, State, metrics, observe, reset, step
from pogema_rs.jax._goals import truncate
from pogema_rs.jax._pool import draw_instance
from pogema_rs.jax._step import NUM_ACTIONS

__all__ = ["PogemaGymnax"]


class PogemaGymnax(Environment):
    """An environment of one agent with the interface of gymnax 1.0.

    Its parameters are `InstancePool.params`; every reset draws an instance with the key it gets. The infos are POGEMA's
    metrics, which are valid only after the step that ends an episode.

    Shape: an observation is `(3, side, side)`, float32: obstacles, agents, goal

    Errors: ValueError for instances of more than one agent.
    """

    def __init__(self, pool: InstancePool) -> None:
        if pool.config.num_agents != 1:
            raise ValueError(
                f"num_agents is {pool.config.num_agents}, expected 1; JaxMARL's interface plays several agents"
            )
        self._params = pool.params

    @property
    def default_params(self) -> Params:
        """The parameters of the pool."""
        return self._params

    @property
    def name(self) -> str:
        """The name of the environment."""
        return "POGEMA"

    @property
    def num_actions(self) -> int:
        """The number of actions."""
        return NUM_ACTIONS

    def reset_env(self, key: jax.Array, params: Params) -> tuple[jax.Array, State]:
        """Begins an episode and returns the observation and the state."""
        state = reset(params, draw_instance(params, key))
        return observe(params, state)[0], state

    def step_env(
        self, key: jax.Array, state: State, action: jax.Array, params: Params
    ) -> tuple[jax.Array, State, jax.Array, jax.Array, dict[str, Any]]:
        """Plays one step without a reset at the end of an episode."""
        state, out = step(params, state, jax.numpy.reshape(action, 1))
        found = metrics(params.config, state.counts, state.num_agents, params.max_steps)
        return observe(params, state)[0], state, out.rewards[0], out.terminated[0], found

    def observe(self, key: jax.Array, state: State, action: Optional[jax.Array], params: Params) -> jax.Array:
        """Returns the observation of a state."""
        return observe(params, state)[0]

    def is_truncated(self, state: State, params: Params) -> jax.Array:
        """Returns whether the episode has reached its step limit."""
        return truncate(params, state)[0]

    def action_space(self, params: Optional[Params] = None) -> Discrete:
        """The five actions."""
        return Discrete(NUM_ACTIONS)

    def observation_space(self, params: Optional[Params] = None) -> Box:
        """The observation."""
        side = (self._params if params is None else params).config.side
        return Box(0.0, 1.0, (3, side, side))
