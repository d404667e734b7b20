"""Plays one episode in any process: its task and its outcome."""

from __future__ import annotations

import json
import time
import traceback
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Optional

from pogema_rs._engine import machine, play_built_in
from pogema_rs.toolbox.registry import ToolboxRegistry


@dataclass(frozen=True)
class Task:
    """An episode to play."""

    index: int
    algorithm: str
    settings: dict[str, Any]
    environment: dict[str, Any]
    #: The map that the environment names.
    maps: dict[str, str] = field(default_factory=dict)
    #: Whether the algorithm is built in, rather than registered in Python.
    is_built_in: bool = False


@dataclass(frozen=True)
class Outcome:
    """The outcome of an episode: its metrics, or an error."""

    index: int
    metrics: Optional[dict[str, Any]] = None
    #: Time of the policy alone if the environment measures it, otherwise of the whole episode. Units: seconds
    runtime: float = 0.0
    #: The machine that played it.
    machine: str = ""
    #: The time of the network and what the planner proved, of a built-in algorithm.
    of_planner: dict[str, Any] = field(default_factory=dict)
    error: str = ""
    traceback: str = ""
    #: The episode, packed for a page that replays it, if requested.
    film: str = ""


#: Cache of the algorithm that this process played last, because loading one may take minutes.
_ready: dict[str, tuple[dict[str, Any], Any, Any]] = {}


def play(task: Task, is_filmed: bool = False) -> Outcome:
    """Plays an episode; an exception of the policy or the environment becomes part of the outcome."""
    try:
        return _play(task, is_filmed)
    except Exception as error:  # noqa: BLE001 - a policy may raise anything
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        return Outcome(task.index, error=reason, traceback=traceback.format_exc())


def forget() -> None:
    """Drops the algorithm that this process played last, because another one may be registered under its name."""
    _ready.clear()


#: The state from which this process made its registry.
_state: list[dict[str, Any]] = []


def play_with(state: dict[str, Any], task: Task) -> Outcome:
    """Plays an episode with the registry of another process, which all tasks of a run share."""
    if not (_state and _state[0] is state):
        ToolboxRegistry.recreate_from_state(state)
        _state[:] = [state]
        forget()
    return play(task)


def _play(task: Task, is_filmed: bool) -> Outcome:
    if task.is_built_in:
        content = {"environment": task.environment, "algorithms": {task.algorithm: task.settings}}
        played = json.loads(play_built_in(json.dumps(content), list(task.maps.items())))
        of_planner = {name: played[name] for name in ("network_time", "proof") if name in played}
        return Outcome(task.index, played["metrics"], played["runtime"], machine(), of_planner=of_planner)
    ToolboxRegistry.register_maps(task.maps)
    algorithm, settings = _algorithm(task)
    env = ToolboxRegistry.create_env(task.environment.get("name", "Environment"), **task.environment)
    if settings.preprocessing:
        env = ToolboxRegistry.create_algorithm_preprocessing(env, task.settings["name"], **task.settings)
    if is_filmed:
        env.unwrapped.enable_animation()
    began = time.perf_counter()
    metrics = dict(ToolboxRegistry.run_episode(env, algorithm, settings.run_episode_func))
    runtime = metrics.pop("runtime", time.perf_counter() - began)
    if task.environment.get("with_animation"):
        _draw(env, task)
    film = env.unwrapped._engine.pack_film() if is_filmed else ""
    shown = {name: plain(value) for name, value in metrics.items()}
    return Outcome(task.index, shown, float(runtime), machine(), film=film)


def _algorithm(task: Task) -> tuple[Any, Any]:
    known = _ready.get(task.algorithm)
    if known is None or known[0] != task.settings:
        name = task.settings["name"]
        settings = ToolboxRegistry.create_algorithm_config(name, **task.settings)
        known = task.settings, ToolboxRegistry.create_algorithm(name, **task.settings), settings
        _ready.clear()
        _ready[task.algorithm] = known
    return known[1], known[2]


def _draw(env: Any, task: Task) -> None:
    folder = Path("renders", task.algorithm)
    folder.mkdir(parents=True, exist_ok=True)
    env.unwrapped.save_animation(str(folder / f"episode-{task.index:05}.svg"))


def plain(value: Any) -> Any:
    """Returns a number of NumPy or PyTorch as a Python number, and a value without the method `item` unchanged.

    Errors: ValueError for a NumPy array of several numbers.
    """
    return value.item() if hasattr(value, "item") else value
