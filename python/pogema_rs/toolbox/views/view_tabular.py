"""Tables of means."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, Union

import numpy as np

from pogema_rs._optional import import_optional
from pogema_rs.toolbox.registry import ToolboxRegistry
from pogema_rs.toolbox.views.view_utils import View, drop_na, eval_logs_to_pandas

__all__ = ["Aggregator", "TabularView", "View", "preprocess_table", "process_table_view"]


class TabularView(View):
    """The options of a table; `show_std` and `skip_zero_std` have no effect.

    Source: pogema-toolbox 0.1.1, `view_tabular.py`, `TabularView`
    """

    print_results: bool = False
    type: Literal["tabular"] = "tabular"
    table_format: str = "psql"
    show_std: bool = True
    skip_zero_std: bool = True


class Aggregator:
    """Formats an estimate of some numbers, by default their mean, with half the width of its interval.

    `estimator` is a function of the numbers, or a name that pandas knows. `error_method` is `ci` (percentiles of the
    estimates of samples drawn with NumPy's global generator), `sd` (a multiple of the standard deviation) or `None` (no
    interval). `error_level` is the percentage of `ci`, or the factor of `sd`.

    Source: pogema-toolbox 0.1.1, `view_tabular.py`, `Aggregator`
    """

    def __init__(
        self,
        estimator: Union[Callable[..., Any], str] = np.mean,
        error_method: str | None = "ci",
        error_level: float = 1.96,
        round_digits: int = 2,
    ) -> None:
        self.estimator = estimator
        self.error_method = error_method
        self.error_level = error_level
        self.round_digits = round_digits

    def __call__(self, vals: Any) -> str:
        """Returns the text, for example `3.50 ± 0.25`; a single number has no interval.

        Errors: `KeyError` for an unknown `error_method`.
        """
        text = f"{self._estimate(vals):.{self.round_digits}f}"
        if self.error_method is None or len(vals) <= 1:
            return text
        return f"{text} ± {self._half_interval(vals):.{self.round_digits}f}"

    def _estimate(self, vals: Any) -> Any:
        return self.estimator(vals) if callable(self.estimator) else vals.agg(self.estimator)

    def _half_interval(self, vals: Any) -> float:
        if self.error_method == "sd":
            return vals.std() * self.error_level
        if self.error_method == "ci":
            # Samples of `bootstrap` are arrays, which do not know pandas's names of functions.
            func = self.estimator if callable(self.estimator) else lambda sample: self._estimate(type(vals)(sample))
            low, high = self._percentile_interval(self.bootstrap(vals, func=func), self.error_level)
            return (high - low) / 2
        raise KeyError(f"`error_method` is `{self.error_method}`, expected `ci`, `sd` or None")

    @staticmethod
    def _percentile_interval(data: Any, percentile: float) -> tuple[float, float]:
        tails = (100 - percentile) / 2
        low, high = np.percentile(data, [tails, 100 - tails])
        return low, high

    @staticmethod
    def bootstrap(data: Any, n_boot: int = 1000, func: Any = np.mean) -> np.ndarray:
        """Returns the value of `func` for each of `n_boot` samples, drawn with replacement by NumPy's global generator.

        Shape: `(n_boot,)`
        """
        samples = np.random.choice(data, size=(n_boot, len(data)), replace=True)
        return np.apply_along_axis(func, 1, samples)


def preprocess_table(eval_configs: Sequence[Mapping[str, Any]], view: View) -> Any:
    """Returns the frame of a table: a row for each combination of the varied fields that are not dropped.

    Errors: `ImportError` without pandas; ValueError without results.

    Source: pogema-toolbox 0.1.1, `view_tabular.py`, `preprocess_table`
    """
    if not eval_configs:
        raise ValueError("there are no results, expected at least one row")
    df = eval_logs_to_pandas(eval_configs)
    drop_na(df)  # only for its warnings: a table keeps the columns with missing values
    metrics = [name for name in eval_configs[0].get("metrics", ()) if name in df.columns]
    groups = [name for name in df.columns if name not in metrics and name not in view.drop_keys]
    aggregator = Aggregator(
        error_method=getattr(view, "error_method", "ci"),
        error_level=getattr(view, "error_level", 95),
        round_digits=view.round_digits,
    )
    table = df.groupby(by=groups, as_index=False).agg({name: aggregator for name in metrics})
    table = table.drop(columns=view.drop_keys, errors="ignore")
    if view.sort_by:
        table = table.sort_values(by=view.sort_by)
    return table.rename(columns=view.rename_fields)


def process_table_view(results: Sequence[Mapping[str, Any]], view: TabularView) -> None:
    """Logs a table if `view.print_results` is set.

    Errors: `ImportError` without pandas or tabulate; ValueError without results.

    Source: pogema-toolbox 0.1.1, `view_tabular.py`, `process_table_view`
    """
    if view.print_results:
        tabulate = import_optional("tabulate", "a view of type `tabular`").tabulate
        table = preprocess_table(results, view)
        ToolboxRegistry.info("\n" + tabulate(table, headers="keys", tablefmt=view.table_format))
