"""The task and the outcome of an episode, and the functions that play it in any process."""

from __future__ import annotations

import json
import threading
import time
import traceback
from collections.abc import Mapping, Sequence
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
    #: Why the environment cannot be made, if that is known.
    error: str = ""


@dataclass(frozen=True)
class Outcome:
    """The outcome of an episode: its metrics, or an error."""

    index: int
    metrics: Optional[dict[str, Any]] = None
    #: Time of the policy alone if the environment measures it, otherwise of the whole episode. Units: seconds
    runtime: float = 0.0
    #: The machine that played the episode.
    machine: str = ""
    #: For built-in algorithms: `network_time` and `proof`, if the algorithm has them.
    built_in_fields: dict[str, Any] = field(default_factory=dict)
    error: str = ""
    traceback: str = ""
    #: The episode, packed for a page that replays it, if requested.
    film: str = ""


#: Cache of the algorithm that each thread played last, because loading one may take minutes. An algorithm has a state,
#: so threads, for example those of a Dask worker, must not share it.
_ready: dict[int, tuple[str, dict[str, Any], Any, Any]] = {}


def play(task: Task, is_filmed: bool = False) -> Outcome:
    """Plays an episode; an exception of the policy or the environment becomes part of the outcome.

    The maps of the task stay registered.
    """
    if task.error:
        return Outcome(task.index, error=task.error)
    try:
        return _play(task, is_filmed)
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a policy may raise anything
        return Outcome(task.index, error=reason(error), traceback=traceback.format_exc())


def play_here(task: Task, is_filmed: bool = False) -> Outcome:
    """Plays an episode in the caller's process, whose registered maps stay as they were."""
    maps = ToolboxRegistry.get_maps()
    before = {name: maps.get(name) for name in task.maps}
    try:
        return play(task, is_filmed)
    finally:
        for name, grid in before.items():
            if grid is None:
                maps.pop(name, None)
            else:
                maps[name] = grid


def reason(error: BaseException) -> str:
    """Returns the class of an exception and the first line of its text that is not blank."""
    try:
        lines = str(error).splitlines()
    except Exception:  # noqa: BLE001 - the exception may be of a policy's class, whose `__str__` may raise anything
        lines = []
    return f"{type(error).__name__}: {next(filter(str.strip, lines), 'no message')}"


def forget() -> None:
    """Drops the algorithms that this process played last, because others may be registered under their names."""
    _ready.clear()


#: The state from which this process made its registry.
_state: list[dict[str, Any]] = []
_state_lock = threading.Lock()


def play_with(state: dict[str, Any], task: Task) -> Outcome:
    """Plays an episode with the registry of another process, which all tasks of a run share."""
    with _state_lock:
        if not (_state and _state[0] is state):
            ToolboxRegistry.recreate_from_state(state)
            _state[:] = [state]
            forget()
    return play(task)


def _play(task: Task, is_filmed: bool) -> Outcome:
    if task.is_built_in:
        content = {"environment": task.environment, "algorithms": {task.algorithm: task.settings}}
        played = json.loads(play_built_in(json.dumps(content), list(task.maps.items())))
        built_in_fields = {name: played[name] for name in ("network_time", "proof") if name in played}
        return Outcome(task.index, played["metrics"], played["runtime"], machine(), built_in_fields=built_in_fields)
    ToolboxRegistry.get_maps().update(task.maps)
    algorithm, settings = _algorithm(task)
    env = make_env(task.environment, task.settings, settings)
    if is_filmed:
        env.unwrapped.enable_animation()
    began = time.perf_counter()
    metrics = ToolboxRegistry.run_episode(env, algorithm, settings.run_episode_func)
    seconds = time.perf_counter() - began
    metrics = _in_json(metrics)
    runtime = metrics.pop("runtime", seconds)
    if task.environment.get("with_animation"):
        _draw(env, task)
    film = env.unwrapped._engine.pack_film() if is_filmed else ""
    return Outcome(task.index, metrics, float(runtime), machine(), film=film)


def make_env(environment: Mapping[str, Any], settings: Mapping[str, Any], config: Any) -> Any:
    """Makes an environment with the preprocessing of an algorithm; `config` is made from its `settings`."""
    env = ToolboxRegistry.create_env(environment.get("name", "Environment"), **environment)
    if config.preprocessing:
        env = ToolboxRegistry.create_algorithm_preprocessing(env, settings["name"], **settings)
    return env


def _algorithm(task: Task) -> tuple[Any, Any]:
    thread = threading.get_ident()
    known = _ready.get(thread)
    if known is None or known[:2] != (task.algorithm, task.settings):
        _ready.pop(thread, None)  # before the next algorithm is loaded, which may need the memory of the previous one
        name = task.settings["name"]
        settings = ToolboxRegistry.create_algorithm_config(name, **task.settings)
        algorithm = ToolboxRegistry.create_algorithm(name, **task.settings)
        known = _ready[thread] = task.algorithm, task.settings, algorithm, settings
    return known[2:]


def _draw(env: Any, task: Task) -> None:
    folder = Path("renders", task.algorithm)
    folder.mkdir(parents=True, exist_ok=True)
    env.unwrapped.save_animation(str(folder / f"episode-{task.index:05}.svg"))


def plain(value: Any) -> Any:
    """Returns a NumPy or PyTorch number as a Python number, and a value without the method `item` unchanged.

    Errors: ValueError for a NumPy array of several numbers.
    """
    return value.item() if hasattr(value, "item") else value


def to_json(value: Any) -> Any:
    """Returns a NumPy or PyTorch number or array as a number or a list, for `default` of `json.dumps`.

    Errors: TypeError for any other value.
    """
    if not hasattr(value, "tolist"):
        raise TypeError(f"a value of type {type(value).__name__} is not JSON")
    return value.tolist()


def plain_tree(value: Any, path: str = "") -> Any:
    """Returns nested mappings and sequences as dictionaries and lists, with Python's numbers.

    Errors: ValueError with the path of a value that a suite cannot hold.
    """
    if isinstance(value, Mapping):
        return {str(key): plain_tree(part, f"{path}.{key}" if path else str(key)) for key, part in value.items()}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    if isinstance(value, Sequence) and not isinstance(value, (bytes, bytearray)):
        return [plain_tree(part, f"{path}[{index}]") for index, part in enumerate(value)]
    raise ValueError(f"suite: `{path}` has type {type(value).__name__}, expected a value that YAML holds")


def _in_json(metrics: Mapping[str, Any]) -> dict[str, Any]:
    """Returns metrics as JSON holds them.

    Errors: ValueError that names the first metric that JSON cannot hold, for example NaN.
    """
    found: dict[str, Any] = {}
    for name, value in metrics.items():
        try:
            found.update(json.loads(json.dumps({name: value}, default=to_json, allow_nan=False)))
        except (TypeError, ValueError) as error:
            kind = type(value).__name__
            raise ValueError(
                f"the metric {name!r} has type {kind}, expected a value that JSON holds: {error}"
            ) from None
    return found
