"""Plots with several panels, drawn in Rust."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, Literal, Optional, Union

from pogema_rs.toolbox.views.view_plot import (
    PlotView,
    drop_na,
    eval_logs_to_pandas,
    prepare_plot_fields,
    process_plot_view,
)

__all__ = [
    "MultiPlotView",
    "PlotView",
    "drop_na",
    "eval_logs_to_pandas",
    "prepare_plot_fields",
    "process_multi_plot_view",
]


class MultiPlotView(PlotView):
    """The options of a plot with a panel for each value of the column `over`; width and height are those of a panel.

    `legend_bbox_to_anchor` has no effect.

    Source: pogema-toolbox 0.1.1, `view_multi_plot.py`, `MultiPlotView`
    """

    type: Literal["multi-plot"] = "multi-plot"  # type: ignore[assignment]
    over: Optional[str] = None
    num_cols: int = 3
    share_x: bool = False
    share_y: bool = False
    remove_individual_titles: bool = True
    legend_bbox_to_anchor: tuple[float, float] = (0.5, -0.05)
    legend_loc: str = "lower center"  # type: ignore[assignment]
    legend_columns: int = 5
    width: float = 2.0
    height: float = 2.0


def process_multi_plot_view(
    results: Sequence[Mapping[str, Any]], view: MultiPlotView, save_path: Union[str, os.PathLike[str], None] = None
) -> None:
    """Writes a plot to a file, like `process_plot_view`.

    Source: pogema-toolbox 0.1.1, `view_multi_plot.py`, `process_multi_plot_view`
    """
    process_plot_view(results, view, save_path)
