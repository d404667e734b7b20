"""What gymnasium reads when it is imported: `gymnasium.make` knows our environment without any import of ours."""

from __future__ import annotations

from gymnasium.envs.registration import register, registry


def register_envs() -> None:
    """Registers `pogema_rs/Pogema-v0`, and `Pogema-v0` unless POGEMA has taken it."""
    for name in ("Pogema-v0", "pogema_rs/Pogema-v0"):
        if name not in registry:
            register(id=name, entry_point="pogema_rs.integrations.make_pogema:make_single_agent_gym")
