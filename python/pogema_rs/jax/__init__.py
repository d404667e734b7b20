"""The rules of POGEMA as pure JAX functions, for training loops that are compiled as a whole.

Each function works on one environment; `jax.vmap` makes a batch, for `step` with `(None, 0, 0)` as the axes of params,
state and actions. Needs the extra `jax`: `pip install "pogema-rs[jax]"`.

| file | content |
| --- | --- |
| `_config`, `_pool`, `_pack` | static sizes and rules; the instances, made in Rust; their maps as rows of bits |
| `_state` | the state, and the reset that begins an episode |
| `_step`, `_checked` | the order of the phases in a step; the next episode; steps that check actions |
| `_collide` | conflicting moves |
| `_goals`, `_division` | the effects of reaching a goal: rewards, ends and next goals; exact quotients for rewards |
| `_observe`, `_unpack` | observations |
| `_metrics`, `_density` | the metrics of an episode; the density of agents in windows |
| `_cost_to_go` | steps to the goals, and windows that show them |
| `port` | the functions as a port of the conformance kit |
"""

from __future__ import annotations

try:
    import jax as _jax  # noqa: F401
except ImportError as _error:
    raise ImportError(
        'pogema_rs.jax needs JAX, which the extra `jax` installs: pip install "pogema-rs[jax]"'
    ) from _error

from pogema_rs.jax._checked import checked_step
from pogema_rs.jax._config import Config
from pogema_rs.jax._cost_to_go import cost_to_go, cost_to_go_windows
from pogema_rs.jax._density import agents_density
from pogema_rs.jax._metrics import exact_metrics, metrics
from pogema_rs.jax._observe import GlobalState, action_masks, global_state, observe, observe_rows
from pogema_rs.jax._pool import InstancePool, Params, Pool
from pogema_rs.jax._state import State, reset
from pogema_rs.jax._step import StepOut, auto_reset, step
from pogema_rs.jax._unpack import unpack, unpack_rows

__all__ = [
    "Config",
    "GlobalState",
    "InstancePool",
    "Params",
    "Pool",
    "State",
    "StepOut",
    "action_masks",
    "agents_density",
    "auto_reset",
    "checked_step",
    "cost_to_go",
    "cost_to_go_windows",
    "exact_metrics",
    "global_state",
    "metrics",
    "observe",
    "observe_rows",
    "reset",
    "step",
    "unpack",
    "unpack_rows",
]
