"""Environments for JaxMARL, played by `pogema_rs.jax`."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jaxmarl.environments.multi_agent_env import MultiAgentEnv
from jaxmarl.environments.spaces import Box, Discrete

from pogema_rs.jax import InstancePool, State, action_masks, metrics, observe, reset, step
from pogema_rs.jax._pool import draw_instance
from pogema_rs.jax._step import NUM_ACTIONS

__all__ = ["PogemaJaxMARL"]


class PogemaJaxMARL(MultiAgentEnv):
    """An environment with JaxMARL's interface. Its agents are `agent_0`, `agent_1` and so on.

    Every reset draws an instance of the pool by its key. Instances and rules are constants of the compiled functions,
    because this interface has no place for parameters, so `InstancePool.refill` has no effect here.

    Each agent observes obstacles, agents and its goal. It is done when it is terminated or truncated; `__all__` is done
    when the episode ends. The infos are POGEMA's metrics, the same for every agent, and 0 before the step that ends
    the episode.

    Shape: an observation is `(3, side, side)`, float32; an info is `(agents,)`, float32
    """

    def __init__(self, pool: InstancePool) -> None:
        super().__init__(num_agents=pool.config.num_agents)
        self.params = pool.params
        side = pool.config.side
        self.observation_spaces = {agent: Box(0.0, 1.0, (3, side, side)) for agent in self.agents}
        self.action_spaces = {agent: Discrete(NUM_ACTIONS) for agent in self.agents}

    @property
    def name(self) -> str:
        """The name of the environment."""
        return "POGEMA"

    @property
    def agent_classes(self) -> dict[str, list[str]]:
        """The names of the agents, all of one class."""
        return {"agents": self.agents}

    @partial(jax.jit, static_argnums=0)
    def reset(self, key: jax.Array) -> tuple[dict[str, jax.Array], State]:
        """Begins an episode and returns observations by name, and the state."""
        state = reset(self.params, draw_instance(self.params, key))
        return self.get_obs(state), state

    def step_env(
        self, key: jax.Array, state: State, actions: dict[str, jax.Array]
    ) -> tuple[dict[str, jax.Array], State, dict[str, jax.Array], dict[str, jax.Array], dict[str, Any]]:
        """Plays one step without a reset at the end of an episode."""
        state, out = step(self.params, state, jnp.stack([actions[agent] for agent in self.agents]))
        found = metrics(self.params.config, state.counts, state.num_agents, self.params.max_steps)
        infos = {name: jnp.full(self.num_agents, jnp.where(out.ended, value, 0.0)) for name, value in found.items()}
        dones = {**self._named(out.terminated | out.truncated), "__all__": out.ended}
        return self.get_obs(state), state, self._named(out.rewards), dones, infos

    def get_obs(self, state: State) -> dict[str, jax.Array]:
        """Returns the observations by name."""
        return self._named(observe(self.params, state))

    @partial(jax.jit, static_argnums=0)
    def get_avail_actions(self, state: State) -> dict[str, jax.Array]:
        """Returns by name the actions that no obstacle reverts."""
        return self._named(action_masks(self.params, state))

    def _named(self, rows: jax.Array) -> dict[str, jax.Array]:
        return dict(zip(self.agents, rows))
