"""Reads the configs and the number of threads of a `VecEnv`."""

from __future__ import annotations

import pickle
import sys
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Optional

import numpy as np

from pogema_rs import _engine, grid_registry
from pogema_rs._checks import check_whole
from pogema_rs._counted import counted
from pogema_rs.grid_config import GridConfig, engine_fields

# The fields that the engine reads, and the text of a named map.
Config = tuple[dict[str, Any], Optional[str]]
# The numbers of agents, and of rows and columns.
Room = tuple[Optional[int], Optional[tuple[int, int]]]

_INDEX = ", an index of an environment"


def engine_config(config: Any, reward: str, argument: str = "config") -> Config:
    """Returns the fields that the engine reads, and the text of the map that the config names.

    Errors name the argument.
    """
    if not isinstance(config, GridConfig):
        config = GridConfig(**_fields(config, argument))
    if config.map_name is not None:
        grid_registry.get_grid(config.map_name)  # raises an error for an unknown name, which an environment ignores
    return {**engine_fields(config), "reward": reward}, grid_registry.map_text(config.map_name)


def _fields(config: Any, argument: str) -> Mapping[str, Any]:
    if isinstance(config, Mapping):
        return config
    dump = getattr(config, "model_dump", None) or getattr(config, "dict", None)
    if dump is None:
        kind = type(config).__name__
        raise TypeError(f"{argument} holds a value of type {kind}, expected a GridConfig or a dict, or a list of them")
    return dump()


def read_configs(
    configs: Any, num_envs: Optional[int], reward: str, argument: str = "grid_config"
) -> tuple[list[Config], Optional[list[int]], int]:
    """Returns the distinct configs, the index of each environment's config, and the number of environments.

    The indices are `None` if a single config, not a list, is given. Errors name the argument.
    """
    if not isinstance(configs, (list, tuple)):
        num_envs = check_whole("num_envs", 1 if num_envs is None else num_envs)
        return [engine_config(configs, reward, argument)], None, min(num_envs, sys.maxsize)
    if not configs:
        raise ValueError(f"{argument} is an empty list, expected at least one config")
    if num_envs not in (None, len(configs)):
        raise ValueError(f"num_envs is {num_envs}, expected {len(configs)}, one for each config of the list")
    configs = [engine_config(config, reward, argument) for config in configs]
    # Configs with equal pickles are read once. Two equal configs with different pickles are read twice, which is
    # harmless.
    keys = [pickle.dumps(config) for config in configs]
    places = {key: place for place, key in enumerate(dict.fromkeys(keys))}
    first = {places[key]: config for key, config in zip(reversed(keys), reversed(configs))}
    return [first[place] for place in range(len(places))], [places[key] for key in keys], len(configs)


def read_changes(
    configs: Any, envs: Optional[Sequence[int]], num_envs: int, reward: str
) -> tuple[list[Config], Optional[list[int]], list[int]]:
    """Returns new configs as `read_configs` does, and the environments that get them.

    Errors: TypeError or ValueError for wrong arguments.
    """
    if isinstance(envs, str) or not (envs is None or hasattr(envs, "__iter__")):
        raise TypeError(f"envs is {envs!r}, expected a list of indices")
    every = range(num_envs) if envs is None else envs
    chosen = [check_whole(f"envs[{place}]", env, 0, num_envs - 1, _INDEX) for place, env in enumerate(every)]
    if len(set(chosen)) != len(chosen):
        raise ValueError(f"envs is {chosen}, expected each environment once")
    if not isinstance(configs, (list, tuple)):
        return [engine_config(configs, reward, "configs")], None, chosen
    if len(configs) != len(chosen):
        found = counted(len(configs), "config")
        raise ValueError(f"configs holds {found}, expected {len(chosen)}, one per environment")
    if not chosen:
        return [], [], []
    read, of_env, _ = read_configs(configs, None, reward, "configs")
    return read, of_env, chosen


def read_room(num_agents: Any, map_size: Any) -> Room:
    """Returns the minimum capacity of the arrays: the number of agents, and the numbers of rows and columns."""
    if num_agents is not None:
        num_agents = min(check_whole("num_agents", num_agents), sys.maxsize)
    if map_size is None:
        return num_agents, None
    sides = (map_size, map_size) if isinstance(map_size, (int, np.integer)) else map_size
    if not isinstance(sides, (list, tuple)) or len(sides) != 2:
        raise TypeError(f"map_size is {map_size!r}, expected a whole number or a pair (rows, columns)")
    rows, columns = (min(check_whole("map_size", side), sys.maxsize) for side in sides)
    return num_agents, (rows, columns)


def read_threads(num_threads: Optional[int]) -> Optional[int]:
    if num_threads is None:
        return None
    num_threads = check_whole("num_threads", num_threads, 1, _engine.MAX_THREADS)
    if num_threads > _engine.num_cores():
        text = f"num_threads is {num_threads}, but the machine has only {counted(_engine.num_cores(), 'core')}"
        warnings.warn(text, UserWarning, stacklevel=3)
    return num_threads
