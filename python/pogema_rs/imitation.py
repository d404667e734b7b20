"""Expert episodes for imitation learning: the observations of agents and the actions of a planner."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Optional, Union

import numpy as np

from pogema_rs._files import replaced
from pogema_rs.grid_config import GridConfig
from pogema_rs.integrations.make_pogema import pogema_v0
from pogema_rs.planners import plan
from pogema_rs.semantics import Semantics

__all__ = ["collect", "episode_seed"]


def collect(
    grid_config: GridConfig,
    folder: Union[str, os.PathLike[str]],
    num_episodes: int,
    *,
    planner: str = "lacam",
    seconds: Optional[float] = None,
    nodes: Optional[int] = None,
    seed: int = 0,
    episodes_per_file: int = 32,
    num_workers: int = 2,
    semantics: Union[str, Semantics] = Semantics.DEVELOPED,
) -> Iterator[Path]:
    """Plays episodes with a planner and writes them into a folder; yields the path of each file once it is written.

    File k, `episodes-<k>.npz`, holds the episodes from `k * episodes_per_file` on. An episode depends only on `seed`
    and its number. If a call is interrupted, repeat it: it keeps existing files and writes the missing ones. With a
    budget of `nodes`, the same call writes the same episodes on every machine. With a budget of `seconds` [default: 1
    if `nodes` is not given] plans depend on the machine. Episodes that the planner does not solve are left out. Ctrl-C
    ends the call at once; plans that have begun go on in the background, but no further file is begun.

    Shape: s is the number of steps in a file, over all its episodes in order. `observations` `(s, agents, 3, side,
    side)`, uint8; `actions` `(s, agents)`, int8; `is_active` `(s, agents)`, bool, False where the agent is not active;
    `episode` `(s,)`, int64, the number of the episode; `seeds` `(episodes,)`, int64, POGEMA's seeds.

    Errors: ValueError for numbers below 1, and the errors of the config.
    """
    for name, value in (
        ("num_episodes", num_episodes),
        ("episodes_per_file", episodes_per_file),
        ("num_workers", num_workers),
    ):
        if value < 1:
            raise ValueError(f"{name} is {value}, expected at least 1")
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    planning = {"planner": planner, "seconds": seconds, "nodes": nodes}
    starts = range(0, num_episodes, episodes_per_file)
    has_stopped = threading.Event()

    def write(first: int) -> Path:
        path = target / f"episodes-{first // episodes_per_file:06}.npz"
        if not path.exists():
            episodes = []
            for number in range(first, min(first + episodes_per_file, num_episodes)):
                episodes.append(_play(grid_config, seed, number, semantics, planning))
                if has_stopped.is_set():
                    return path
            _write(path, episodes)
        return path

    workers = ThreadPoolExecutor(num_workers)
    try:
        yield from workers.map(write, starts)
    finally:
        has_stopped.set()
        workers.shutdown(wait=False, cancel_futures=True)


def episode_seed(seed: int, episode: int) -> int:
    """Returns POGEMA's seed of an episode, as in `VecEnv` for the first episode of environment `episode`."""
    state = np.random.SeedSequence(seed, spawn_key=(episode, 0)).generate_state(1, np.uint64)
    return int(state[0]) % (2**63 - 1)


def _play(
    grid_config: GridConfig, seed: int, number: int, semantics: Union[str, Semantics], planning: dict[str, Any]
) -> dict[str, Any]:
    """Plays one episode by following its plan from the first step to the last."""
    config = grid_config.model_copy(update={"seed": episode_seed(seed, number), "observation_type": "default"})
    env = pogema_v0(config, semantics=semantics)
    observations, infos = env.reset()
    obstacles = env.get_obstacles(ignore_borders=True)
    positions, goals = env.get_agents_xy(ignore_borders=True), env.get_targets_xy(ignore_borders=True)
    found = plan(obstacles, positions, goals, most_steps=config.max_episode_steps, seed=number % 2**63, **planning)
    steps: dict[str, Any] = {"observations": [], "actions": [], "is_active": []}
    if found.is_solved and found.actions is not None:
        for actions in found.actions:
            steps["observations"].append(np.stack(observations).astype(np.uint8))
            steps["actions"].append(actions.astype(np.int8))
            steps["is_active"].append([info["is_active"] for info in infos])
            observations, _, terminated, truncated, infos = env.step(actions.tolist())
            if all(terminated) or all(truncated):
                break
    return {**steps, "number": number, "seed": config.seed}


def _write(path: Path, episodes: list[dict[str, Any]]) -> None:
    """Writes a file of episodes."""
    solved = [episode for episode in episodes if episode["actions"]]

    def joined(name: str) -> np.ndarray:
        return np.concatenate([np.asarray(episode[name]) for episode in solved]) if solved else np.empty(0)

    numbers = [episode["number"] for episode in solved for _ in episode["actions"]]
    with replaced(path) as file:
        np.savez_compressed(
            file,
            observations=joined("observations"),
            actions=joined("actions"),
            is_active=joined("is_active"),
            episode=np.asarray(numbers, dtype=np.int64),
            seeds=np.asarray([episode["seed"] for episode in solved], dtype=np.int64),
        )
