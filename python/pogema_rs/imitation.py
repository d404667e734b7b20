"""Expert episodes for imitation learning: the observations of agents and the actions of a planner."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional, Union

import numpy as np

from pogema_rs._checks import check_semantics, check_whole
from pogema_rs._engine import Stop
from pogema_rs._files import replaced
from pogema_rs.errors import InstanceError
from pogema_rs.grid_config import GridConfig, engine_fields
from pogema_rs.integrations.make_pogema import pogema_v0, read_config
from pogema_rs.planners import _limits, _plan
from pogema_rs.semantics import Semantics

__all__ = ["collect", "episode_seed"]

#: The fields that `collect` sets in the config of each episode; each episode replaces the seed.
_CHOSEN: dict[str, Any] = {"observation_type": "default", "integration": None, "auto_reset": None, "seed": None}


def collect(
    grid_config: Union[GridConfig, Mapping[str, Any]],
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

    The config needs `collision_system="soft"`, because the other systems block moves of a plan, and an `on_target`
    other than `restart`, because a plan ends at the first goals.

    File k, `episodes-<k>.npz`, holds the episodes from `k * episodes_per_file` on. An episode depends only on its
    number and on the arguments other than `num_episodes`, `episodes_per_file` and `num_workers`. If a call is
    interrupted, repeat it: it keeps existing files and writes the missing ones. A call with a larger `num_episodes`
    writes the last file again if that holds fewer episodes than the others. With a budget of `nodes`, the same call
    writes the same episodes on every machine. With a budget of `seconds` [default: 1 if `nodes` is not given] plans
    depend on the machine. Episodes without an instance, and those that the planner does not solve, are left out. Ctrl-C
    ends the call and its plans; no further file is written.

    Shape: s is the number of steps in a file, over all its episodes in order. `observations` `(s, agents, 3, side,
    side)`, uint8; `actions` `(s, agents)`, int8; `is_active` `(s, agents)`, bool, False where the agent is not active;
    `episode` `(s,)`, int64, the number of the episode; `seeds` `(episodes,)`, int64, POGEMA's seeds. `call` is a text
    with the arguments of the call.

    Errors: TypeError or ValueError for wrong arguments, for a config with another `collision_system` or with `restart`,
    and for a folder that holds files of another call; the errors of the config; `InstanceError` if no episode of the
    first file has an instance.
    """
    config = read_config(grid_config)
    if config.collision_system != "soft":
        raise ValueError(f"collision_system is {config.collision_system!r}, expected 'soft', which blocks no plan")
    if config.on_target == "restart":
        raise ValueError("on_target is 'restart', expected 'finish' or 'nothing': a plan ends at the first goals")
    num_episodes = check_whole("num_episodes", num_episodes)
    episodes_per_file = check_whole("episodes_per_file", episodes_per_file)
    num_workers = check_whole("num_workers", num_workers)
    call = _Call(config, planner, seconds, nodes, check_whole("seed", seed, 0), check_semantics(semantics))
    return _collect(call, Path(folder), num_episodes, episodes_per_file, num_workers)


@dataclass(frozen=True)
class _Call:
    """The arguments that the episodes of a call depend on."""

    config: GridConfig
    planner: str
    seconds: Optional[float]
    nodes: Optional[int]
    seed: int
    semantics: Semantics

    def text(self, episodes_per_file: int) -> str:
        """Returns the arguments as JSON, without those that have no effect."""
        fields = {name: value for name, value in engine_fields(self.config).items() if name not in _CHOSEN}
        values = {**vars(self), "config": fields, "episodes_per_file": episodes_per_file}
        return json.dumps(values, default=str)


def _collect(call: _Call, folder: Path, num_episodes: int, episodes_per_file: int, num_workers: int) -> Iterator[Path]:
    folder.mkdir(parents=True, exist_ok=True)
    text, stop = call.text(episodes_per_file), Stop()

    def write(first: int) -> Path:
        path = folder / f"episodes-{first // episodes_per_file:06}.npz"
        numbers = range(first, min(first + episodes_per_file, num_episodes))
        if _num_played(path, text) < len(numbers):
            episodes, missing = [], None
            for number in numbers:
                try:
                    episodes.append(_play(call, number, stop))
                except InstanceError as error:
                    missing = error
                if stop.is_set:
                    return path
            if missing is not None and first == 0 and not episodes:
                raise missing
            _write(path, call.config, episodes, call=np.array(text), num_played=np.int64(len(numbers)))
        return path

    workers = ThreadPoolExecutor(num_workers)
    try:
        yield from workers.map(write, range(0, num_episodes, episodes_per_file))
    finally:
        stop.set()
        workers.shutdown(wait=False, cancel_futures=True)


def _num_played(path: Path, text: str) -> int:
    """Returns the number of episodes that a file holds or leaves out; 0 if there is no file.

    Errors: ValueError for a file of another call.
    """
    if not path.exists():
        return 0
    with np.load(path) as data:
        if "call" not in data or str(data["call"]) != text:
            raise ValueError(f"{path}: the file belongs to another call, expected the same arguments or another folder")
        return int(data["num_played"])


def episode_seed(seed: int, episode: int) -> int:
    """Returns POGEMA's seed of an episode, as in `VecEnv` for the first episode of environment `episode`."""
    state = np.random.SeedSequence(seed, spawn_key=(episode, 0)).generate_state(1, np.uint64)
    return int(state[0]) % (2**63 - 1)


def _play(call: _Call, number: int, stop: Stop) -> dict[str, Any]:
    """Plays one episode by following its plan from the first step to the last."""
    config = call.config.model_copy(update={**_CHOSEN, "seed": episode_seed(call.seed, number)})
    env = pogema_v0(config, semantics=call.semantics)
    observations, infos = env.reset()
    obstacles = env.get_obstacles(ignore_borders=True)
    positions, goals = env.get_agents_xy(ignore_borders=True), env.get_targets_xy(ignore_borders=True)
    limits = _limits(call.seconds, call.nodes, config.max_episode_steps, 1, number % 2**63)
    found = _plan(obstacles, positions, goals, call.planner, limits, stop)
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


def _write(path: Path, config: GridConfig, episodes: list[dict[str, Any]], **others: Any) -> None:
    """Writes a file of episodes."""
    solved = [episode for episode in episodes if episode["actions"]]
    agents, side = config.num_agents, 2 * config.obs_radius + 1
    shapes = {
        "observations": np.empty((0, agents, 3, side, side), dtype=np.uint8),
        "actions": np.empty((0, agents), dtype=np.int8),
        "is_active": np.empty((0, agents), dtype=np.bool_),
    }
    arrays: dict[str, Any] = {
        name: np.concatenate([empty, *(episode[name] for episode in solved)]) for name, empty in shapes.items()
    }
    numbers = [episode["number"] for episode in solved for _ in episode["actions"]]
    with replaced(path) as file:
        np.savez_compressed(
            file,
            **arrays,
            episode=np.asarray(numbers, dtype=np.int64),
            seeds=np.asarray([episode["seed"] for episode in solved], dtype=np.int64),
            **others,
        )
