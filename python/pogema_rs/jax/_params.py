"""The static part of an environment: what the compiled functions are compiled for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Union

from pogema_rs.grid_config import GridConfig
from pogema_rs.semantics import Semantics

#: The largest number of cells of a map with its border. Cells are stored as 32-bit numbers.
MAX_CELLS = 2**30


@dataclass(frozen=True)
class Params:
    """The rules and sizes of an environment. It is hashable, so it can be a static argument of `jax.jit`.

    `height` and `width` are those of the map without its border; all instances of a pool have the same size.
    """

    num_agents: int
    height: int
    width: int
    obs_radius: int = 5
    collision_system: str = "priority"
    on_target: str = "finish"
    max_episode_steps: int = 64
    exact_occupancy: bool = False
    shared_rewards: bool = False

    def __post_init__(self) -> None:
        for name in ("num_agents", "height", "width", "obs_radius"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}, expected at least 1")
        words = {
            "collision_system": ("priority", "block_both", "soft"),
            "on_target": ("finish", "nothing", "restart"),
        }
        for name, known in words.items():
            if getattr(self, name) not in known:
                raise ValueError(f"{name} is {getattr(self, name)!r}, expected one of {', '.join(known)}")
        if self.num_cells > MAX_CELLS:
            raise ValueError(f"the map with its border has {self.num_cells} cells, expected at most {MAX_CELLS}")
        if self.max_episode_steps > 2**31 - 1:
            raise ValueError(f"max_episode_steps is {self.max_episode_steps}, expected at most {2**31 - 1}")

    @classmethod
    def of(
        cls,
        config: Any,
        size: tuple[int, int],
        *,
        semantics: Union[str, Semantics] = Semantics.RELEASED,
        rewards: str = "own",
    ) -> Params:
        """Returns the parameters of a config whose maps have a size, `(rows, columns)`.

        Errors: ValueError for rewards other than `own` and `shared`, for unknown semantics, and for a config that is
        out of range.
        """
        if rewards not in ("own", "shared"):
            raise ValueError(f"rewards is {rewards!r}, expected 'own' or 'shared'")
        config = config if isinstance(config, GridConfig) else GridConfig(**config)
        return cls(
            num_agents=config.num_agents,
            height=size[0],
            width=size[1],
            obs_radius=config.obs_radius,
            collision_system=str(config.collision_system),
            on_target=str(config.on_target),
            max_episode_steps=config.max_episode_steps,
            exact_occupancy=Semantics(semantics).occupancy_is_exact,
            shared_rewards=rewards == "shared",
        )

    @property
    def stride(self) -> int:
        """Number of cells in a row of the map with its border."""
        return self.width + 2 * self.obs_radius

    @property
    def num_cells(self) -> int:
        """Number of cells of the map with its border."""
        return (self.height + 2 * self.obs_radius) * self.stride

    @property
    def side(self) -> int:
        """Number of cells in a row of a window."""
        return 2 * self.obs_radius + 1
