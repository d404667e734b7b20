"""Arrays of whole episodes."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from pogema_rs.baselines._config import TrainingConfig
from pogema_rs.vec_env import NUM_ACTIONS


@dataclass
class Record:
    """Whole episodes. Arrays of states have the axes `(steps + 1, lanes, agents, ...)`; those of transitions have
    `steps` entries.

    Windows hold each value times `2 * radius`, which is a whole number for all channels that a training run accepts.
    """

    #: `(steps + 1, lanes, agents, channels * side * side)`, int8
    windows: np.ndarray
    #: `(steps + 1, lanes, agents, scalars)`, float32
    scalars: np.ndarray
    #: `(steps + 1, lanes, agents, 5)`, bool, False for moves into obstacles
    masks: np.ndarray
    #: `(steps + 1, lanes, agents)`, bool, False for agents that finished
    active: np.ndarray
    #: `(steps + 1, lanes, agents, 4)`, uint8, the cell and the goal
    places: np.ndarray
    #: `(steps, lanes, agents)`, int8
    actions: np.ndarray
    #: `(steps, lanes, agents)`, float32
    rewards: np.ndarray
    #: `(steps, lanes, agents)`, bool, True where the agent has no later reward
    terminated: np.ndarray
    #: `(steps, lanes)`, bool, False after the end of the episode
    played: np.ndarray
    #: `(lanes, rows, columns)`, uint8, 1 for an obstacle
    maps: np.ndarray

    @property
    def shape(self) -> tuple[int, int, int]:
        """The numbers of steps, lanes and agents."""
        steps, lanes, agents = self.actions.shape
        return steps, lanes, agents

    @property
    def acted(self) -> np.ndarray:
        """Which agents acted. Shape: `(steps, lanes, agents)`, bool."""
        acted: np.ndarray = self.active[:-1] & self.played[..., None]
        return acted


def layout(config: TrainingConfig, map_size: tuple[int, int]) -> dict[str, tuple[tuple[int, ...], type]]:
    """Returns the shape of one episode in each array of a `Record`, without the axis of the lanes, and its dtype."""
    steps, agents = config.environment.max_episode_steps, max(config.environment.num_agents)
    channels, side, _ = config.encoder.shape
    return {
        "windows": ((steps + 1, agents, channels * side * side), np.int8),
        "scalars": ((steps + 1, agents, 2 * len(config.encoder.scalars)), np.float32),
        "masks": ((steps + 1, agents, NUM_ACTIONS), np.bool_),
        "active": ((steps + 1, agents), np.bool_),
        "places": ((steps + 1, agents, 4), np.uint8),
        "actions": ((steps, agents), np.int8),
        "rewards": ((steps, agents), np.float32),
        "terminated": ((steps, agents), np.bool_),
        "played": ((steps,), np.bool_),
        "maps": (map_size, np.uint8),
    }


def empty(config: TrainingConfig, map_size: tuple[int, int], lanes: int) -> Record:
    """Returns a record of zeros for `lanes` episodes."""
    arrays: dict[str, np.ndarray] = {}
    for name, (shape, dtype) in layout(config, map_size).items():
        full = (lanes, *shape) if name == "maps" else (shape[0], lanes, *shape[1:])
        arrays[name] = np.zeros(full, dtype=dtype)
    return Record(**arrays)


def _arrays(record: Record) -> dict[str, np.ndarray]:
    return {one.name: getattr(record, one.name) for one in fields(record)}


def by_lane(record: Record) -> dict[str, np.ndarray]:
    """Returns the arrays of a record with the axis of the lanes first."""
    return {name: array if name == "maps" else array.swapaxes(0, 1) for name, array in _arrays(record).items()}


def by_step(arrays: dict[str, np.ndarray]) -> Record:
    """Returns a record of arrays whose first axis is that of the lanes."""
    return Record(**{name: one if name == "maps" else one.swapaxes(0, 1) for name, one in arrays.items()})


def first_agents(record: Record, count: int) -> Record:
    """Returns the arrays of the first agents, which share the memory of the record."""
    arrays = _arrays(record).items()
    return Record(**{name: one if name in ("maps", "played") else one[:, :, :count] for name, one in arrays})


def without_padding(record: Record) -> Record:
    """Returns the arrays of the agents of the episodes, without the rows of padding behind them."""
    return first_agents(record, int(record.active[0].any(axis=0).sum()))


def lanes_of(record: Record, lanes: np.ndarray) -> Record:
    """Returns the episodes of some lanes."""
    arrays = _arrays(record)
    return Record(**{name: array[lanes] if name == "maps" else array[:, lanes] for name, array in arrays.items()})
