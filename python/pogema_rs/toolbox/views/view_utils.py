"""Reads and checks results, for all views."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Optional, Union

from pogema_rs._counted import counted
from pogema_rs._models import Model
from pogema_rs._optional import import_optional
from pogema_rs.errors import MissingSuiteError
from pogema_rs.toolbox.registry import ToolboxRegistry

__all__ = ["View", "check_seeds", "drop_na", "eval_logs_to_pandas", "load_from_folder"]

_Rows = Sequence[Mapping[str, Any]]
_INSTANCE = ("map_name", "num_agents", "seed")


class View(Model):
    """The options of all views.

    Source: pogema-toolbox 0.1.1, `view_utils.py`, `View`
    """

    drop_keys: list = ["seed"]
    round_digits: int = 2
    rename_fields: dict = {
        "algorithm": "Algorithm",
        "num_agents": "Number of Agents",
        "avg_throughput": "Average Throughput",
        "runtime": "Runtime (seconds)",
        "max_episode_steps": "Episode Length",
    }
    rename_algorithms: dict = {}
    sort_by: Optional[Union[str, list[str]]] = None


def drop_na(df: Any) -> Any:
    """Returns a frame without the columns in which a row has no value, and logs a warning for each of them."""
    complete = df.dropna(axis=1, how="any")
    for column in df.columns.difference(complete.columns):
        ToolboxRegistry.warning(f"column `{column}`: some rows have no value")
    return complete


def eval_logs_to_pandas(eval_configs: _Rows) -> Any:
    """Returns a frame with a row for each episode: the varied fields, the algorithm, and metrics other than lists.

    Errors: `ImportError` without pandas.

    Source: pogema-toolbox 0.1.1, `view_utils.py`, `eval_logs_to_pandas`
    """
    pandas = import_optional("pandas", "`eval_logs_to_pandas`")
    rows = []
    for row in eval_configs:
        metrics = {name: value for name, value in row["metrics"].items() if not isinstance(value, list)}
        rows.append({**row["env_grid_search"], "algorithm": row["algorithm"], **metrics})
    return pandas.DataFrame(rows)


def load_from_folder(folder_path: Path) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Returns the results in a folder, and the suite `<name of the folder>.yaml` or `suite.yaml` in it.

    Errors: `AssertionError` if there is no suite, `ImportError` without PyYAML.

    Source: pogema-toolbox 0.1.1, `view_utils.py`, `load_from_folder`
    """
    folder = Path(folder_path)
    suites = [folder / f"{folder.resolve().name}.yaml", folder / "suite.yaml"]
    suite = next((path for path in suites if path.exists()), None)
    if suite is None:
        raise MissingSuiteError(f"there is neither `{suites[0]}` nor `{suites[1]}`, expected the suite of the results")
    content = import_optional("yaml", "`load_from_folder`").safe_load(suite.read_text(encoding="utf-8"))
    results: list[dict[str, Any]] = []
    for path in sorted(folder.glob("*.json")):
        # `about.json` and `*.episodes.json` describe how results were made.
        if path.name != "about.json" and not path.name.endswith(".episodes.json"):
            results += json.loads(path.read_text(encoding="utf-8"))
    return results, content


def check_seeds(results: _Rows) -> None:
    """Logs an error that lists the instances that an algorithm lacks or has more than once.

    If there are none, logs a success.

    Source: pogema-toolbox 0.1.1, `view_utils.py`, `check_seeds`
    """
    counts: dict[tuple, Counter[str]] = {}
    for row in results:
        fields = row.get("env_grid_search")
        missing = [name for name in _INSTANCE if name not in (fields or {})]
        if fields is None or missing:
            ToolboxRegistry.error(f"a row has no `{missing[0] if fields is not None else 'env_grid_search'}`")
            return
        counts.setdefault(tuple(fields[name] for name in _INSTANCE), Counter())[row["algorithm"]] += 1
    algorithms = sorted({row["algorithm"] for row in results})
    problems = [
        f"map {place[0]}, {place[1]} agents, seed {place[2]}: {name} has {counted(counter[name], 'row')}"
        for place, counter in counts.items()
        for name in algorithms
        if counter[name] != 1
    ]
    if problems:
        ToolboxRegistry.error("\n".join([f"{counted(len(problems), 'problem')} with seeds", *problems]))
    else:
        ToolboxRegistry.success("every algorithm has one row for each instance")
