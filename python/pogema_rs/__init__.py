"""POGEMA, the multi-agent pathfinding environment, with bit-identical results, tens to hundreds of times faster.

Change one import, and all results stay the same:

    from pogema_rs import GridConfig, pogema_v0

Each name is imported at its first use. Importing the package imports only its engine, and gymnasium to register the
environments.

Modules with POGEMA's names: `pogema_rs.a_star_policy`, `pogema_rs.envs`, `pogema_rs.generator`, `pogema_rs.grid`,
`pogema_rs.grid_config`, `pogema_rs.grid_registry`, `pogema_rs.utils`, `pogema_rs.svg_animation` with
`pogema_rs.svg_animation.animation_drawer`, `pogema_rs.svg_animation.animation_wrapper` and
`pogema_rs.svg_animation.svg_objects`, and `pogema_rs.wrappers` with `pogema_rs.wrappers.metrics`,
`pogema_rs.wrappers.multi_time_limit` and `pogema_rs.wrappers.persistence`.

Additional modules: `pogema_rs.vec_env`, `pogema_rs.packed`, `pogema_rs.planners`, `pogema_rs.policies`,
`pogema_rs.imitation`, `pogema_rs.torch`, `pogema_rs.semantics`, `pogema_rs.errors`, `pogema_rs.install`,
`pogema_rs.svg_animation.filmed` and `pogema_rs.wrappers.forwarding`.

Evaluations, in `pogema_rs.toolbox`, with the names of pogema-toolbox and a command line (`python -m`):
`pogema_rs.toolbox.evaluator`, `pogema_rs.toolbox.registry`, `pogema_rs.toolbox.create_env`,
`pogema_rs.toolbox.algorithm_config`, `pogema_rs.toolbox.run_episode`, `pogema_rs.toolbox.results_holder`,
`pogema_rs.toolbox.config_variant_generator`, `pogema_rs.toolbox.eval_utils`, `pogema_rs.toolbox.moving_ai_ingestion`,
`pogema_rs.toolbox.fix_num_threads_issue`, `pogema_rs.toolbox.views` with `pogema_rs.toolbox.views.view_utils`,
`pogema_rs.toolbox.views.view_tabular`, `pogema_rs.toolbox.views.view_plot` and
`pogema_rs.toolbox.views.view_multi_plot`, and `pogema_rs.toolbox.generators` with
`pogema_rs.toolbox.generators.generator_utils`, `pogema_rs.toolbox.generators.maze_generator`,
`pogema_rs.toolbox.generators.random_generator` and `pogema_rs.toolbox.generators.warehouse_generator`.

Trainers, with a command line (`python -m`): `pogema_rs.baselines`.
The rules as functions for JAX: `pogema_rs.jax`, and their port for the conformance kit: `pogema_rs.jax.port`.

Adapters for frameworks, in `pogema_rs.integrations`: `pogema_rs.integrations.gymnax`,
`pogema_rs.integrations.jaxmarl`, `pogema_rs.integrations.make_pogema`, `pogema_rs.integrations.pettingzoo`,
`pogema_rs.integrations.pufferlib`, `pogema_rs.integrations.pymarl`, `pogema_rs.integrations.rllib`,
`pogema_rs.integrations.sample_factory`,
`pogema_rs.integrations.sample_factory_batched` and `pogema_rs.integrations.torchrl`.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import gymnasium

from pogema_rs._engine import __version__

if TYPE_CHECKING:
    from pogema_rs.a_star_policy import AStarAgent, BatchAStarAgent
    from pogema_rs.grid_config import GridConfig
    from pogema_rs.install import install_as_pogema
    from pogema_rs.integrations.make_pogema import pogema_v0
    from pogema_rs.packed import unpack
    from pogema_rs.semantics import Semantics
    from pogema_rs.svg_animation.animation_drawer import SvgAnimation
    from pogema_rs.svg_animation.animation_wrapper import AnimationConfig, AnimationMonitor
    from pogema_rs.vec_env import Film, VecEnv
    from pogema_rs.wrappers.forwarding import Wrapper

__all__ = [
    "AStarAgent",
    "AnimationConfig",
    "AnimationMonitor",
    "BatchAStarAgent",
    "Film",
    "GridConfig",
    "Semantics",
    "SvgAnimation",
    "VecEnv",
    "Wrapper",
    "__version__",
    "install_as_pogema",
    "pogema_v0",
    "unpack",
]

_HOMES = {
    "AStarAgent": "a_star_policy",
    "AnimationConfig": "svg_animation.animation_wrapper",
    "AnimationMonitor": "svg_animation.animation_wrapper",
    "BatchAStarAgent": "a_star_policy",
    "Film": "vec_env",
    "GridConfig": "grid_config",
    "Semantics": "semantics",
    "SvgAnimation": "svg_animation.animation_drawer",
    "VecEnv": "vec_env",
    "Wrapper": "wrappers.forwarding",
    "install_as_pogema": "install",
    "pogema_v0": "integrations.make_pogema",
    "unpack": "packed",
}
# In POGEMA, `import pogema` already imports these modules. Here, they are imported at their first use.
_MODULES = (
    *("a_star_policy", "envs", "generator", "grid", "grid_config", "grid_registry", "integrations"),
    *("svg_animation", "utils", "wrappers"),
)


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return importlib.import_module(f"{__name__}.{name}")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES, *_MODULES})


for _id in ("Pogema-v0", "pogema_rs/Pogema-v0"):
    # If POGEMA itself is imported, it keeps the plain name.
    if _id not in gymnasium.registry:
        gymnasium.register(id=_id, entry_point="pogema_rs.integrations.make_pogema:make_single_agent_gym")
