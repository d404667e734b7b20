"""Plots of means, drawn in Rust."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from math import isnan
from pathlib import Path
from typing import Any, Literal, Optional, Union

from pogema_rs import _engine
from pogema_rs.toolbox._work import to_json
from pogema_rs.toolbox.registry import ToolboxRegistry
from pogema_rs.toolbox.views import show_rows
from pogema_rs.toolbox.views.view_utils import View, drop_na, eval_logs_to_pandas

__all__ = [
    "PlotView",
    "ToolboxRegistry",
    "View",
    "draw",
    "drop_na",
    "eval_logs_to_pandas",
    "prepare_plot_fields",
    "process_plot_view",
]


class PlotView(View):
    """The options of a plot; `plt_style` and `tight_layout` have no effect.

    Source: pogema-toolbox 0.1.1, `view_plot.py`, `PlotView`
    """

    type: Literal["plot"] = "plot"
    name: Optional[str] = None
    x: Optional[str] = None
    y: Optional[str] = None
    by: str = "algorithm"
    width: float = 2.6
    height: float = 2.8
    remove_title: bool = False
    line_width: float = 2.0
    error_bar: tuple[str, int] = ("ci", 95)
    plt_style: str = "seaborn-v0_8-colorblind"
    figure_dpi: int = 300
    font_size: int = 8
    legend_font_size: int = 7
    legend_loc: Literal[
        "best", "upper right", "upper left", "lower left", "lower right", "right",
        "center left", "center right", "lower center", "upper center", "center",
    ] = "best"  # fmt: skip
    figure_face_color: str = "#FFFFFF"
    use_log_scale_x: bool = False
    use_log_scale_y: bool = False
    markers: bool = True
    line_types: bool = True
    extension: Literal["svg", "png", "pdf"] = "pdf"
    #: Colours of the lines [default: those of `pogema views`].
    palette: Optional[list] = None
    hue_order: Optional[list] = None
    tight_layout: bool = True
    ticks: Optional[list] = None
    remove_legend_title: bool = True


def process_plot_view(
    results: Sequence[Mapping[str, Any]], view: PlotView, save_path: Union[str, os.PathLike[str], None] = None
) -> None:
    """Writes a plot to a file, whose extension is the format; logs a warning if the results lack a column.

    Errors: `ValueError` for an extension other than `.pdf`, `.png` or `.svg`, or for a wrong option.

    Source: pogema-toolbox 0.1.1, `view_plot.py`, `process_plot_view`
    """
    if save_path is not None:
        draw(results, view.dict(), save_path)


def prepare_plot_fields(view: PlotView) -> tuple[Optional[str], Optional[str], str]:
    """Returns the displayed names of the columns `x`, `y` and `by`."""
    names = view.rename_fields
    return names.get(view.x, view.x), names.get(view.y, view.y), names.get(view.by, view.by)


def draw(
    results: Sequence[Mapping[str, Any]],
    fields: Mapping[str, Any],
    save_path: Union[str, os.PathLike[str]],
    dataset: str = "results",
) -> list[str]:
    """Draws a view of any type that `pogema views` knows, and returns its tables as text.

    `save_path` is the file of its plot, whose extension is the format: `.pdf`, `.png` or `.svg`. `dataset` is the name
    of the results for views that compare them with published ones.

    Errors: `ValueError` for another extension or a wrong option.
    """
    target = Path(save_path)
    extension = target.suffix.removeprefix(".")
    if extension not in ("pdf", "png", "svg"):
        raise ValueError(f"`save_path` is `{target}`, expected a name that ends in `.pdf`, `.png` or `.svg`")
    check_views({target.stem: fields})
    rows = json.dumps([_shown(row) for row in results], default=to_json)
    with tempfile.TemporaryDirectory() as temporary:
        # JSON is YAML.
        views = Path(temporary, "views.yaml")
        views.write_text(_as_json({target.stem: _with_absolute_paths(fields)}), encoding="utf-8")
        shown = show_rows(rows, dataset, views, extension, Path(temporary, "plots"))
        for file in (file for view in shown for file in view.files):
            shutil.move(file, target)
    return [table for view in shown for table in view.tables]


def check_views(views: Mapping[Any, Mapping[str, Any]]) -> None:
    """Checks the options of views of any type that `pogema views` knows.

    Errors: `ValueError` for an unknown type or a wrong option.
    """
    _engine.check_views(_as_json(views))


def _as_json(views: Mapping[Any, Mapping[str, Any]]) -> str:
    return json.dumps({"results_views": {str(name): dict(fields) for name, fields in views.items()}}, default=to_json)


def _with_absolute_paths(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the fields with absolute paths; relative ones are resolved against the current folder."""
    whole = {key: os.path.abspath(fields[key]) for key in ("file", "episodes") if isinstance(fields.get(key), str)}
    return {**fields, **whole}


def _shown(row: Mapping[str, Any]) -> dict[str, Any]:
    """Returns a row for the plotter in Rust, without the metrics that are NaN, which JSON lacks."""
    metrics = {key: value for key, value in row["metrics"].items() if not (isinstance(value, float) and isnan(value))}
    return {**row, "metrics": metrics}
