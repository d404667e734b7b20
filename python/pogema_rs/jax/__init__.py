"""The rules of POGEMA 1.4.0 as pure functions for JAX: for `jit`, `vmap` and `scan`, on CPU, GPU and TPU.

    from pogema_rs.jax import InstancePool, observe, reset, step

    pool = InstancePool({"num_agents": 8, "size": 16}, 100, seed=0)
    state = reset(pool.params, pool.arrays, 0)
    state, outcome = step(pool.params, state, actions)
    windows = observe(pool.params, state)

Importing this module imports JAX; importing `pogema_rs` does not. Install it with `pip install 'pogema-rs[jax]'`.

Errors: ImportError without JAX, with the command that installs it.
"""

from pogema_rs.toolbox._optional import required

required("jax", "pogema_rs.jax")

from pogema_rs.jax._params import Params
from pogema_rs.jax._pool import InstancePool, Instances
from pogema_rs.jax._observe import observe
from pogema_rs.jax._state import State, reset
from pogema_rs.jax._step import Outcome, step, step_and_reset

__all__ = [
    "InstancePool",
    "Instances",
    "Outcome",
    "Params",
    "State",
    "observe",
    "reset",
    "step",
    "step_and_reset",
]
