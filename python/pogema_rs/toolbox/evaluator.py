"""Runs suites: plays all episodes of all algorithms and stores each one."""

from __future__ import annotations

import json
import os
import platform
import sys
import time
import weakref
from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any, Literal, Optional, Union

from pogema_rs._counted import counted
from pogema_rs._engine import Evaluation, num_cores
from pogema_rs._forward import forwarded
from pogema_rs._optional import import_optional
from pogema_rs.errors import InternalError
from pogema_rs.install import is_installed
from pogema_rs.toolbox import _backends, _replacing
from pogema_rs.toolbox._chunks import (
    balanced_dask_backend,
    balanced_multiprocess_backend,
    dask_backend,
    get_balanced_buckets_indexes,
    get_env_config_cost,
    get_num_of_available_cpus,
    multiprocess_backend,
    sequential_backend,
    split_on_chunks,
)
from pogema_rs.toolbox._replacing import join_metrics_and_configs, run_views
from pogema_rs.toolbox._work import Outcome, Task, forget, plain_tree, play_here
from pogema_rs.toolbox.algorithm_config import AlgoBase
from pogema_rs.toolbox.registry import ToolboxRegistry
from pogema_rs.toolbox.views import show
from pogema_rs.utils import grid_to_str

__all__ = [
    "EvaluationError",
    "balanced_dask_backend",
    "balanced_multiprocess_backend",
    "dask_backend",
    "evaluation",
    "get_balanced_buckets_indexes",
    "get_env_config_cost",
    "get_num_of_available_cpus",
    "join_metrics_and_configs",
    "multiprocess_backend",
    "run_views",
    "sequential_backend",
    "split_on_chunks",
]

# pogema-toolbox's module offers these names too.
__getattr__, __dir__ = forwarded(
    __name__,
    {
        "Environment": "toolbox.create_env",
        "MultiPlotView": "toolbox.views.view_multi_plot",
        "PlotView": "toolbox.views.view_plot",
        "TabularView": "toolbox.views.view_tabular",
        "generate_variants": "toolbox.config_variant_generator",
        "process_multi_plot_view": "toolbox.views.view_multi_plot",
        "process_plot_view": "toolbox.views.view_plot",
        "process_table_view": "toolbox.views.view_tabular",
    },
)

_Path = Union[str, os.PathLike[str]]


#: The open evaluations, whose locks a forked child must not keep.
_open: weakref.WeakSet[Evaluation] = weakref.WeakSet()


def _release_in_child() -> None:
    for suite in _open:
        suite.release()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_release_in_child)


class EvaluationError(RuntimeError):
    """Some episodes failed; the files `<algorithm>.failed.jsonl` hold the errors, and `resume` tries again."""


def evaluation(
    evaluation_config: Union[_Path, Mapping[str, Any]],
    eval_dir: Optional[_Path] = None,
    *,
    begin: Optional[Literal["new", "resume", "anew", "replace"]] = None,
    maps: Sequence[_Path] = (),
    dask: Optional[str] = None,
    html: Optional[_Path] = None,
) -> list[dict[str, Any]]:
    """Plays the missing episodes of a suite and returns all results in the layout of pogema-toolbox.

    `evaluation_config` is a YAML file or its content. `begin` says how to treat earlier results in the folder
    `eval_dir`: `new` rejects them, `resume` continues an interrupted run of the same suite, `anew` deletes them,
    `replace` does what pogema-toolbox does [default: `new`; `replace` after `install_as_pogema(toolbox=True)` or
    without a folder]. `maps` are files and folders with maps in addition to the registered ones. `dask` is the address
    of a scheduler for algorithms with a Dask `parallel_backend` [default: the one in the suite, otherwise a cluster of
    processes on this machine]. At the end the tables of `results_views` are printed, and plots are written to `views`
    in the folder. `html` is the file for a page with these tables and plots, and with replays of the worst and best
    episodes. These episodes are played again for the page.

    With `replace`, any folder without `about.json` is accepted, for example that of the suite. The call writes
    `<algorithm>.json` at the end of each algorithm. At the end of the run, it writes the plots and logs the tables. It
    writes no other files. The first error of a policy ends the run. Algorithms must be registered, and the options that
    follow `begin` are not available.

    If an algorithm is not registered, its name selects a built-in planner or policy. If its `parallel_backend` is Dask
    and an address is given, Dask plays it. Otherwise, threads play it.

    Errors: before the first episode, ValueError for a wrong suite, with the line of the error, and for an unknown
    algorithm; OSError for a file or folder that cannot be used; the error of the settings class for wrong settings of a
    registered algorithm. If episodes failed, `EvaluationError` after all other episodes were played.

    Source: pogema-toolbox 0.1.1, `evaluator.py`, `evaluation`
    """
    if begin is None:
        begin = "replace" if eval_dir is None or is_installed("pogema_toolbox") else "new"
    if begin == "replace":
        given = {"maps": maps, "dask": dask, "html": html}
        for name in (name for name, value in given.items() if value):
            raise ValueError(f"`{name}` is given and `begin` is `replace`, expected `new`, `resume` or `anew`")
        return _replacing.evaluate(_content(evaluation_config), eval_dir)
    if eval_dir is None:
        raise ValueError(f"`eval_dir` is `None` and `begin` is `{begin}`, expected a folder")
    if isinstance(evaluation_config, Mapping):
        path, text = Path("suite.yaml"), json.dumps(plain_tree(evaluation_config))
    else:
        path, text = Path(evaluation_config), None
    registered = ToolboxRegistry.get_maps().items()
    grids = [(name, grid if isinstance(grid, str) else grid_to_str(grid)) for name, grid in registered]
    suite = Evaluation(str(path), text, str(eval_dir), grids, [str(file) for file in maps])
    for warning in suite.warnings():
        ToolboxRegistry.warning(warning)
    algorithms = _algorithms(suite)
    _check_algorithms(suite, algorithms)
    suite.open(begin, _versions())
    _open.add(suite)
    try:
        return _evaluated(suite, algorithms, Path(eval_dir), dask or suite.dask(), html, path.parent)
    finally:
        # A traceback may keep the suite alive.
        suite.release()


def _evaluated(
    suite: Evaluation,
    algorithms: Mapping[str, dict[str, Any]],
    eval_dir: Path,
    address: Optional[str],
    html: Optional[_Path],
    folder: Path,
) -> list[dict[str, Any]]:
    """Plays the missing episodes, shows the views, and returns all results; `folder` is the folder of the suite."""
    num_failed = 0
    results: list[dict[str, Any]] = []
    for key, settings in algorithms.items():
        num_failed += _run(suite, key, settings, address, folder)
        results += _results(eval_dir, key)
    if results and suite.has_views():
        for shown in show(eval_dir):
            for table in shown.tables:
                print(table)
    if results and html is not None:
        _write_page(suite, html)
    if num_failed:
        raise EvaluationError(f"{counted(num_failed, 'episode')} could not be played; see {eval_dir}/*.failed.jsonl")
    return results


def _content(evaluation_config: Union[_Path, Mapping[str, Any]]) -> Mapping[str, Any]:
    if isinstance(evaluation_config, Mapping):
        return evaluation_config
    text = Path(evaluation_config).read_text(encoding="utf-8")
    return import_optional("yaml", "a suite in a file with begin='replace'").safe_load(text)


def _algorithms(suite: Evaluation) -> dict[str, dict[str, Any]]:
    """Returns the settings of the algorithms of a suite, by the names of their results."""
    algorithms = {}
    for key, name, parameters, num_processes, backend in suite.algorithms():
        algorithms[key] = {"name": name, **json.loads(parameters), "parallel_backend": backend}
        if num_processes is not None:
            algorithms[key]["num_process"] = num_processes
    return algorithms


def _is_registered(settings: dict[str, Any]) -> bool:
    return settings["name"] in ToolboxRegistry.get_state()["algorithms"]


def _check_algorithms(suite: Evaluation, algorithms: Mapping[str, dict[str, Any]]) -> None:
    """Raises an error if an algorithm is unknown or its settings are wrong."""
    suite.check_algorithms(list(ToolboxRegistry.get_state()["algorithms"]))
    for settings in algorithms.values():
        if _is_registered(settings):
            ToolboxRegistry.create_algorithm_config(settings["name"], **settings)


def _write_page(suite: Evaluation, path: _Path) -> None:
    """Writes the page of the results, and replays the episodes of policies in Python for it."""
    algorithms = _algorithms(suite)
    again: list[Optional[tuple[str, str, str]]] = []
    for key, index in suite.picks():
        if key not in algorithms or not _is_registered(algorithms[key]):
            again.append(None)
        else:
            outcome = play_here(_task(suite, index, key, algorithms[key]), is_filmed=True)
            again.append((json.dumps(outcome.metrics), outcome.film, outcome.error))
    suite.write_report(os.fspath(path), again)


def _run(suite: Evaluation, key: str, settings: dict[str, Any], address: Optional[str], folder: Path) -> int:
    """Plays the missing episodes of an algorithm and returns the number of failed ones.

    `folder` is the folder of the suite.
    """
    progress = _Progress(key, suite.num_episodes())
    is_built_in = not _is_registered(settings)
    if is_built_in and not (settings["parallel_backend"].endswith("dask") and address is not None):
        threads = min(settings.get("num_process", num_cores()), num_cores())
        _, num_failed, _ = suite.run_built_in(key, threads, progress)
        return num_failed
    if is_built_in and "weights" in settings:
        # Other processes do not know the folder of the suite.
        settings = {**settings, "weights": os.path.abspath(folder / settings["weights"])}
    make = AlgoBase if is_built_in else partial(ToolboxRegistry.create_algorithm_config, settings["name"])
    config = make(**settings)
    forget()
    to_do = suite.begin(key)
    if to_do is None:
        return 0
    progress.begin(len(to_do))
    num_failed = 0
    tasks = (_task(suite, index, key, settings, is_built_in) for index in to_do)
    with closing(_outcomes(tasks, config, address)) as outcomes:
        for outcome in outcomes:
            if outcome.metrics is None:
                num_failed += 1
                suite.note(outcome.index, suite.environment(outcome.index), outcome.error, outcome.traceback)
            else:
                episode = {"index": outcome.index, "metrics": outcome.metrics, "runtime": outcome.runtime}
                suite.keep(json.dumps({**episode, **outcome.built_in_fields}), outcome.machine)
            progress.step(outcome.index, outcome.error)
    if not suite.finish() and not num_failed:
        raise InternalError(f"internal error, please report it: `{key}` ended without all episodes")
    return num_failed


def _outcomes(tasks: Iterable[Task], config: Any, address: Optional[str]) -> Generator[Outcome, None, None]:
    backend, num_processes = config.parallel_backend, min(config.num_process, num_cores())
    if backend == "sequential":
        yield from _backends.sequential(tasks)
    elif backend.endswith("dask"):
        yield from _backends.dask(tasks, num_processes, address)
    else:
        yield from _backends.processes(tasks, num_processes)


def _task(suite: Evaluation, index: int, key: str, settings: dict[str, Any], is_built_in: bool = False) -> Task:
    try:
        environment, error = json.loads(suite.whole_environment(index)), ""
    except (OSError, ValueError) as wrong:  # the scenario fits other episodes, but not this one
        environment, error = json.loads(suite.environment(index)), str(wrong)
    maps: dict[str, str] = {}
    name = environment.get("map_name")
    if name is not None and environment.get("use_maps", True) and not suite.is_foreign():
        name, text = suite.map(name, environment.get("seed") or 0)
        environment["map_name"] = name
        # Every process has a registered map. But if the map has starts and goals, they are now fields of the
        # environment, so the task carries the map without them.
        is_known = name in ToolboxRegistry.get_maps() and not is_built_in and environment.get("agents_xy") is None
        maps = {} if is_known else {name: text}
    return Task(index, key, settings, environment, maps, is_built_in, error)


def _results(folder: Path, key: str) -> list[dict[str, Any]]:
    path = folder / f"{key}.json"
    if not path.exists():
        return []
    rows, episodes = (_read_json(file) for file in (path, folder / f"{key}.episodes.json"))
    for row, episode in zip(rows, episodes):
        row["metrics"].setdefault("runtime", episode["seconds"])
        if "network_seconds" in episode:
            row["metrics"].setdefault("network_time", episode["network_seconds"])
    return rows


def _read_json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise OSError(f"{path}: {error}, expected the JSON that an earlier run wrote") from None


def _versions() -> list[tuple[str, str]]:
    """Returns the versions of Python and of the loaded packages that policies use."""
    loaded = [(name, sys.modules.get(name)) for name in ("numpy", "gymnasium", "torch", "onnxruntime", "distributed")]
    known = [(name, str(getattr(module, "__version__", ""))) for name, module in loaded if module is not None]
    return [("Python", platform.python_version()), *known]


class _Progress:
    """Logs the progress of an algorithm at intervals."""

    #: Interval between messages. Units: seconds
    EVERY = 10.0

    def __init__(self, key: str, total: int) -> None:
        self._key, self._total = key, total
        self._began = self._last_message = time.monotonic()
        self._done = self._before = 0

    def begin(self, num_left: int) -> None:
        self._before = self._done = self._total - num_left
        ToolboxRegistry.info(f"{self._key}: {num_left} of {self._total} episodes to play")

    def step(self, index: int, error: str) -> None:
        self._done += 1
        if error:
            ToolboxRegistry.error(f"{self._key}: episode {index}: {error}")
        now = time.monotonic()
        if now - self._last_message >= self.EVERY:
            self._last_message = now
            played = self._done - self._before
            left = (now - self._began) / played * (self._total - self._done)
            ToolboxRegistry.info(f"{self._key}: {self._done} of {self._total} episodes, {left:.0f} s left")
