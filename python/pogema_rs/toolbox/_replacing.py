"""Evaluations that replace earlier results, and write the files of pogema-toolbox only."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Optional, Union

from pogema_rs._counted import counted
from pogema_rs._files import write_text
from pogema_rs._optional import import_optional
from pogema_rs.toolbox import _chunks
from pogema_rs.toolbox._work import to_json
from pogema_rs.toolbox.config_variant_generator import generate_variants
from pogema_rs.toolbox.registry import ToolboxRegistry
from pogema_rs.toolbox.views.view_multi_plot import MultiPlotView, process_multi_plot_view
from pogema_rs.toolbox.views.view_plot import PlotView, check_views, draw, process_plot_view
from pogema_rs.toolbox.views.view_tabular import TabularView, process_table_view

_Path = Union[str, os.PathLike[str]]
_Rows = list[dict[str, Any]]

_BACKENDS: dict[str, Callable[..., list[dict[str, Any]]]] = {
    "sequential": _chunks.sequential_backend,
    "multiprocessing": _chunks.multiprocess_backend,
    "dask": _chunks.dask_backend,
    "balanced_multiprocessing": _chunks.balanced_multiprocess_backend,
    "balanced_dask": _chunks.balanced_dask_backend,
}
# The types of views in pogema-toolbox, with the classes of their options.
_VIEWS: dict[str, Callable[..., Any]] = {"tabular": TabularView, "plot": PlotView, "multi-plot": MultiPlotView}


def evaluate(evaluation_config: Mapping[str, Any], eval_dir: Optional[_Path]) -> _Rows:
    """Plays all episodes in memory, and writes `<algorithm>.json` and plots into the folder.

    Without a folder, writes only the plots, into the current folder.

    Errors: `FileExistsError` if the folder holds a run that can be resumed, because its other files would not match the
    new results.
    """
    if eval_dir is not None and Path(eval_dir, "about.json").exists():
        raise FileExistsError(
            f"{eval_dir}: has the `about.json` of a run that can be resumed; choose another folder, "
            "or delete the run with begin='anew'"
        )
    views = evaluation_config.get("results_views") or {}
    _check_views(views)
    algorithms = evaluation_config["algorithms"]
    backends = {str(key): _backend_of(settings) for key, settings in algorithms.items()}
    variants = list(generate_variants(evaluation_config["environment"]))
    changes, environments = [variant[0] for variant in variants], [variant[1] for variant in variants]
    results: _Rows = []
    for key, settings in algorithms.items():
        key = str(key)
        metrics = backends[key](settings, environments, key)
        rows = join_metrics_and_configs(metrics, environments, changes, settings, key)
        if eval_dir is not None:
            write_text(Path(eval_dir, f"{key}.json"), json.dumps(rows, default=to_json))
        results += rows
        ToolboxRegistry.success(f"{key}: {counted(len(rows), 'episode')} played")
    run_views(results, evaluation_config, eval_dir=eval_dir)
    return results


def _backend_of(settings: Mapping[str, Any]) -> Callable[..., list[dict[str, Any]]]:
    config = ToolboxRegistry.create_algorithm_config(settings["name"], **settings)
    if config.parallel_backend not in _BACKENDS:
        raise ValueError(f"`parallel_backend` is `{config.parallel_backend}`, expected one of {', '.join(_BACKENDS)}")
    return _BACKENDS[config.parallel_backend]


def join_metrics_and_configs(
    metrics: Sequence[Any],
    evaluation_configs: Sequence[Mapping[str, Any]],
    env_grid_search: Iterable[Mapping[tuple[str, ...], Any]],
    algo_config: Mapping[str, Any],
    algo_name: str,
) -> _Rows:
    """Returns a row for each episode: `metrics`, the varied fields as `env_grid_search`, and `algorithm`.

    Source: pogema-toolbox 0.1.1, `evaluator.py`, `join_metrics_and_configs`
    """
    return [
        {
            "metrics": one,
            "env_grid_search": {path[-1]: value for path, value in changes.items()},
            "algorithm": algo_name,
        }
        for one, changes in zip(metrics, env_grid_search)
    ]


def run_views(
    results: Sequence[Mapping[str, Any]], evaluation_config: Mapping[str, Any], eval_dir: Optional[_Path] = None
) -> None:
    """Logs the tables of `results_views`, and writes each plot to `<name of the view>.pdf` in the folder.

    The default folder is the current one. `tabular` views are tables as in pogema-toolbox. All other types are drawn
    as in `pogema views`; for those that pogema-toolbox lacks, the name of the folder is the name of the dataset.

    Source: pogema-toolbox 0.1.1, `evaluator.py`, `run_views`
    """
    folder = Path(eval_dir if eval_dir is not None else ".")
    for key, fields in (evaluation_config.get("results_views") or {}).items():
        target = folder / f"{key}.pdf"
        target.parent.mkdir(parents=True, exist_ok=True)
        if fields["type"] == "tabular":
            process_table_view(results, TabularView(**fields))
        elif fields["type"] == "plot":
            process_plot_view(results, PlotView(**fields), target)
        elif fields["type"] == "multi-plot":
            process_multi_plot_view(results, MultiPlotView(**fields), target)
        else:
            for table in draw(results, fields, target, folder.resolve().name or "results"):
                ToolboxRegistry.info("\n" + table)


def _check_views(views: Mapping[Any, Mapping[str, Any]]) -> None:
    """Raises the error of a wrong view or a missing package before the first episode, not after the last one."""
    for name, fields in views.items():
        if "type" not in fields:
            raise ValueError(f"the view `{name}` of `results_views` has no `type`")
        if fields["type"] in _VIEWS:
            _VIEWS[fields["type"]](**fields)
        if fields["type"] == "tabular" and fields.get("print_results"):
            for package in ("pandas", "tabulate"):
                import_optional(package, "a view of type `tabular` with `print_results`")
    check_views(views)
