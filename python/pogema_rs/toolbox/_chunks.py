"""Backends that play all episodes of an algorithm, chunk by chunk, and keep the results in memory.

Each chunk has its own instance of the algorithm. If an algorithm keeps a state between episodes, for example a
random generator, its results therefore depend on the chunks, which are those of pogema-toolbox.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Optional

import numpy as np

from pogema_rs._engine import num_cores
from pogema_rs.toolbox._backends import dask_client, process_pool
from pogema_rs.toolbox._work import make_env, plain
from pogema_rs.toolbox.create_env import Environment
from pogema_rs.toolbox.registry import ToolboxRegistry

__all__ = [
    "balanced_dask_backend",
    "balanced_multiprocess_backend",
    "dask_backend",
    "get_balanced_buckets_indexes",
    "get_env_config_cost",
    "get_num_of_available_cpus",
    "multiprocess_backend",
    "sequential_backend",
    "split_on_chunks",
]

_Config = Mapping[str, Any]
_Metrics = list[dict[str, Any]]


def sequential_backend(
    algo_config: _Config,
    env_configs: Sequence[_Config],
    full_algo_name: str,
    registry_state: Optional[Mapping[str, Any]] = None,
) -> _Metrics:
    """Plays the episodes one after the other with one algorithm, and returns their metrics.

    Source: pogema-toolbox 0.1.1, `evaluator.py`, `sequential_backend`
    """
    if registry_state is not None:
        ToolboxRegistry.recreate_from_state(registry_state)
    name = algo_config["name"]
    algorithm = ToolboxRegistry.create_algorithm(name, **algo_config)
    settings = ToolboxRegistry.create_algorithm_config(name, **algo_config)
    results = []
    for number, fields in enumerate(env_configs, start=1):
        ToolboxRegistry.info(f"{full_algo_name}: episode {number} of {len(env_configs)}")
        env = make_env(fields, algo_config, settings)
        metrics = ToolboxRegistry.run_episode(env, algorithm, settings.run_episode_func)
        results.append({metric: plain(value) for metric, value in metrics.items()})
        if fields.get("with_animation"):
            folder = Path("renders", full_algo_name)
            folder.mkdir(parents=True, exist_ok=True)
            env.save_animation(name=folder / env.pick_name(env.unwrapped.grid_config))
    return results


def split_on_chunks(size: int, num_chunks: int) -> Iterator[tuple[int, int]]:
    """Yields the start and the end of each of `num_chunks` consecutive chunks; all but the last have the same size.

    Source: pogema-toolbox 0.1.1, `evaluator.py`, `split_on_chunks`
    """
    length = int(size / num_chunks + 0.5)
    for number in range(num_chunks):
        yield number * length, size if number == num_chunks - 1 else (number + 1) * length


def get_env_config_cost(raw_config: _Config) -> int:
    """Returns the number of agents times the number of steps of an episode."""
    config = Environment(**raw_config)
    return config.num_agents * config.max_episode_steps


def get_balanced_buckets_indexes(env_configs: Sequence[_Config], num_buckets: int) -> list[list[int]]:
    """Returns buckets of similar cost, each as the indices of its episodes; no bucket is empty.

    Source: pogema-toolbox 0.1.1, `evaluator.py`, `get_balanced_buckets_indexes`
    """
    costs = [get_env_config_cost(config) for config in env_configs]
    buckets: list[list[int]] = [[] for _ in range(num_buckets)]
    totals = [0] * num_buckets
    for index in np.argsort(costs)[::-1].tolist():
        cheapest = totals.index(min(totals))
        buckets[cheapest].append(index)
        totals[cheapest] += costs[index]
    return [bucket for bucket in buckets if bucket]


def get_num_of_available_cpus() -> int:
    """Returns the number of processors that this process may use."""
    return num_cores()


def multiprocess_backend(algo_config: _Config, env_configs: Sequence[_Config], full_algo_name: str) -> _Metrics:
    """Plays consecutive chunks of the episodes in processes.

    Source: pogema-toolbox 0.1.1, `evaluator.py`, `multiprocess_backend`
    """
    return _in_processes(algo_config, env_configs, full_algo_name, _consecutive(algo_config, env_configs))


def balanced_multiprocess_backend(
    algo_config: _Config, env_configs: Sequence[_Config], full_algo_name: str
) -> _Metrics:
    """Plays buckets of similar cost in processes.

    Source: pogema-toolbox 0.1.1, `evaluator.py`, `balanced_multiprocess_backend`
    """
    return _in_processes(algo_config, env_configs, full_algo_name, _balanced(algo_config, env_configs))


def dask_backend(algo_config: _Config, env_configs: Sequence[_Config], full_algo_name: str) -> _Metrics:
    """Plays consecutive chunks of the episodes on a local Dask cluster.

    Source: pogema-toolbox 0.1.1, `evaluator.py`, `dask_backend`
    """
    return _on_dask(algo_config, env_configs, full_algo_name, _consecutive(algo_config, env_configs))


def balanced_dask_backend(algo_config: _Config, env_configs: Sequence[_Config], full_algo_name: str) -> _Metrics:
    """Plays buckets of similar cost on a local Dask cluster.

    Source: pogema-toolbox 0.1.1, `evaluator.py`, `balanced_dask_backend`
    """
    return _on_dask(algo_config, env_configs, full_algo_name, _balanced(algo_config, env_configs))


def _num_requested_processes(algo_config: _Config) -> int:
    settings = ToolboxRegistry.create_algorithm_config(algo_config["name"], **algo_config)
    return int(settings.num_process)


def _num_processes(algo_config: _Config) -> int:
    return min(_num_requested_processes(algo_config), num_cores())


def _consecutive(algo_config: _Config, env_configs: Sequence[_Config]) -> list[list[int]]:
    # One chunk for each requested process, regardless of the number of processors.
    bounds = split_on_chunks(len(env_configs), _num_requested_processes(algo_config))
    return [list(range(len(env_configs)))[begin:end] for begin, end in bounds]


def _balanced(algo_config: _Config, env_configs: Sequence[_Config]) -> list[list[int]]:
    return get_balanced_buckets_indexes(env_configs, _num_processes(algo_config))


def _in_processes(
    algo_config: _Config, env_configs: Sequence[_Config], key: str, chunks: Sequence[list[int]]
) -> _Metrics:
    with process_pool(_num_processes(algo_config)) as pool:
        futures = [
            pool.submit(sequential_backend, algo_config, [env_configs[index] for index in chunk], key)
            for chunk in chunks
        ]
        return _in_order(chunks, [future.result() for future in futures])


def _on_dask(algo_config: _Config, env_configs: Sequence[_Config], key: str, chunks: Sequence[list[int]]) -> _Metrics:
    with dask_client(_num_processes(algo_config), None) as client:
        state = ToolboxRegistry.get_state()
        futures = [
            client.submit(
                sequential_backend, algo_config, [env_configs[index] for index in chunk], key, state, pure=False
            )
            for chunk in chunks
        ]
        return _in_order(chunks, client.gather(futures))


def _in_order(chunks: Iterable[list[int]], results: Iterable[_Metrics]) -> _Metrics:
    """Returns the metrics of all chunks in the order of the episodes."""
    pairs = [pair for chunk, metrics in zip(chunks, results) for pair in zip(chunk, metrics)]
    return [metrics for _, metrics in sorted(pairs, key=lambda pair: pair[0])]
