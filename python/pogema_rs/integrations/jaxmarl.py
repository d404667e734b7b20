"""Environments for JaxMARL, played by `pogema_rs.jax`.

Importing this module registers them: `jaxmarl.make("pogema", config={...}, num=1000)` makes an `InstancePool` from
its arguments, and an environment.
"""

from __future__ import annotations

import functools
from typing import Any

try:
    import jax
    import jax.numpy as jnp
    import jaxmarl
    from jaxmarl.environments.multi_agent_env import MultiAgentEnv
    from jaxmarl.environments.spaces import Box, Discrete
except ImportError as missing:
    raise ImportError("the JaxMARL integration needs `pip install jaxmarl`, 0.2 or later") from missing

from pogema_rs.jax import InstancePool, State, action_masks, metrics, observe, reset, step
from pogema_rs.jax._pool import draw_instance
from pogema_rs.jax._step import NUM_ACTIONS

__all__ = ["PogemaJaxMARL"]

NAME = "pogema"


class PogemaJaxMARL(MultiAgentEnv):
    """An environment with JaxMARL's interface. Its agents are `agent_0`, `agent_1` and so on.

    Every reset draws an instance of the pool with the key it gets. This interface has no place for parameters, so
    instances and rules are constants of the compiled functions. Therefore `InstancePool.refill` has no effect here.

    Each agent observes obstacles, agents and its goal. If `flatten` is True, the observation is one row, as JaxMARL's
    scripts expect; otherwise it is an image. An agent is done when it is terminated or truncated; `__all__` is done
    when the episode ends. The infos are POGEMA's metrics, the same for every agent, and 0 before the step that ends the
    episode.

    Shape: an observation is `(3 * side * side,)` or `(3, side, side)`, float32; an action is an integer from 0 to 4,
    `()` or `(1,)`; an info is `(agents,)`, float32

    Errors: ValueError or TypeError for actions of another shape or type, before anything is compiled; KeyError if the
    action of an agent is missing.
    """

    def __init__(self, pool: InstancePool, *, flatten: bool = True) -> None:
        super().__init__(num_agents=pool.config.num_agents)
        self.params = pool.params
        side = pool.config.side
        self.observation_shape = (3 * side * side,) if flatten else (3, side, side)
        self.observation_spaces = {agent: Box(0.0, 1.0, self.observation_shape) for agent in self.agents}
        self.action_spaces = {agent: Discrete(NUM_ACTIONS) for agent in self.agents}

    @property
    def name(self) -> str:
        """The name of the environment."""
        return "POGEMA"

    @property
    def agent_classes(self) -> dict[str, list[str]]:
        """The names of the agents, all of one class."""
        return {"agents": self.agents}

    @functools.partial(jax.jit, static_argnums=0)
    def reset(self, key: jax.Array) -> tuple[dict[str, jax.Array], State]:
        """Begins an episode and returns observations by name, and the state."""
        state = reset(self.params, draw_instance(self.params, key))
        return self.get_obs(state), state

    def step_env(
        self, key: jax.Array, state: State, actions: dict[str, jax.Array]
    ) -> tuple[dict[str, jax.Array], State, dict[str, jax.Array], dict[str, jax.Array], dict[str, Any]]:
        """Plays one step without a reset at the end of an episode."""
        state, out = step(self.params, state, jnp.stack([self._action(actions, agent) for agent in self.agents]))
        found = metrics(self.params.config, state.counts, state.num_agents, self.params.max_steps)
        infos = {name: jnp.full(self.num_agents, jnp.where(out.ended, value, 0.0)) for name, value in found.items()}
        dones = {**self._named(out.terminated | out.truncated), "__all__": out.ended}
        return self.get_obs(state), state, self._named(out.rewards), dones, infos

    def get_obs(self, state: State) -> dict[str, jax.Array]:
        """Returns the observations by name."""
        windows = observe(self.params, state)
        return self._named(windows.reshape(self.num_agents, *self.observation_shape))

    @functools.partial(jax.jit, static_argnums=0)
    def get_avail_actions(self, state: State) -> dict[str, jax.Array]:
        """Returns by name the actions that no obstacle blocks."""
        return self._named(action_masks(self.params, state))

    def _named(self, rows: jax.Array) -> dict[str, jax.Array]:
        return dict(zip(self.agents, rows))

    @staticmethod
    def _action(actions: dict[str, jax.Array], agent: str) -> jax.Array:
        shape = jnp.shape(actions[agent])
        # JaxMARL's IPPO gives arrays of one action.
        if shape not in ((), (1,)):
            raise ValueError(f"actions[{agent!r}] has shape {shape}, expected one action; use jax.vmap for a batch")
        return jnp.reshape(actions[agent], ())


def _register() -> None:
    """Adds the environment to `jaxmarl.make`, which knows only those of JaxMARL."""
    original_make = jaxmarl.make

    @functools.wraps(original_make)
    def make(env_id: str, **env_kwargs: Any) -> MultiAgentEnv:
        if env_id != NAME:
            return original_make(env_id, **env_kwargs)
        flatten = env_kwargs.pop("flatten", True)
        return PogemaJaxMARL(InstancePool(**env_kwargs), flatten=flatten)

    jaxmarl.make = make
    # A new list: code that imported `make` before still gets JaxMARL's error for an unknown environment.
    jaxmarl.registered_envs = [*jaxmarl.registered_envs, NAME]


_register()
