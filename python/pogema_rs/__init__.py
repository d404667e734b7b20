"""POGEMA, the multi-agent pathfinding environment, bit for bit and hundreds of times faster.

Change one import and keep every number:

    from pogema_rs import GridConfig, pogema_v0
"""

from __future__ import annotations

from typing import Any

import gymnasium

from pogema_rs._engine import __version__
from pogema_rs.a_star_policy import AStarAgent, BatchAStarAgent
from pogema_rs.grid_config import GridConfig
from pogema_rs.install import install_as_pogema
from pogema_rs.integrations.make_pogema import pogema_v0
from pogema_rs.semantics import Semantics
from pogema_rs.svg_animation.animation_drawer import SvgAnimation
from pogema_rs.svg_animation.animation_wrapper import AnimationConfig, AnimationMonitor
from pogema_rs.wrappers.forwarding import Wrapper

__all__ = [
    "AStarAgent",
    "AnimationConfig",
    "AnimationMonitor",
    "BatchAStarAgent",
    "GridConfig",
    "Semantics",
    "SvgAnimation",
    "VecEnv",
    "Wrapper",
    "__version__",
    "install_as_pogema",
    "pogema_v0",
]


def __getattr__(name: str) -> Any:
    # What few programs need is imported at its first use.
    if name == "VecEnv":
        from pogema_rs.vec_env import VecEnv

        return VecEnv
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


for _id in ("Pogema-v0", "pogema_rs/Pogema-v0"):
    # With POGEMA itself imported the plain name stays its own.
    if _id not in gymnasium.registry:
        gymnasium.register(id=_id, entry_point="pogema_rs.integrations.make_pogema:make_single_agent_gym")
