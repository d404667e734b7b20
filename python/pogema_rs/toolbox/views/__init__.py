"""Tables and plots of results."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Optional, Union

from pogema_rs._engine import show_views
from pogema_rs.toolbox.registry import ToolboxRegistry

__all__ = ["Shown", "show"]

_Path = Union[str, os.PathLike[str]]
# Notes, and for each view its name, tables, files, notes and error.
_Outcome = tuple[list[str], list[tuple[str, list[str], list[str], list[str], Optional[str]]]]


@dataclass(frozen=True)
class Shown:
    """The output of a view."""

    name: str
    #: Its tables as text, each below the view's name.
    tables: list[str]
    #: The files of its plots.
    files: list[Path]
    #: What was left out, or looks wrong.
    notes: list[str]


def show(
    *folders: _Path,
    config: Optional[_Path] = None,
    names: Sequence[str] = (),
    table_format: Optional[Literal["terminal", "markdown", "latex", "csv", "tsv"]] = None,
    plot_format: Optional[Literal["svg", "pdf", "png"]] = None,
    out: Optional[_Path] = None,
    six: Optional[Literal["published", "paper"]] = None,
) -> list[Shown]:
    """Makes the tables and writes the plots of the combined results in folders.

    The views are those in the file `config` [default: the suite stored with the results], and `names` selects some of
    them [default: all]. `table_format` and `plot_format` override the formats in the views. Plots go to the folder
    `out` [default: `views` in the first folder]. `six` overrides the definition of the six metrics in views of the type
    `radar`. `ToolboxRegistry.warning` also logs what was left out, and the errors of views that cannot be shown or
    whose plots cannot be written; the result omits these views.

    Errors: ValueError for wrong views, options or results; OSError for files that cannot be read.

    Source: pogema-toolbox 0.1.1, `evaluator.py`, `run_views`
    """
    if not folders:
        raise ValueError("`folders` is empty, expected at least one folder of results")
    places = [os.fspath(folder) for folder in folders]
    target = os.path.join(places[0], "views") if out is None else os.fspath(out)
    path = None if config is None else os.fspath(config)
    return _shown(show_views(places, path, list(names), (table_format, plot_format, six), target, None))


def show_rows(rows: str, dataset: str, config: Path, plot_format: str, out: Path) -> list[Shown]:
    """Makes the tables and writes the plots of results in JSON, like `show`; `dataset` is the name of the results."""
    return _shown(show_views([], os.fspath(config), [], (None, plot_format, None), os.fspath(out), (rows, dataset)))


def _shown(outcome: _Outcome) -> list[Shown]:
    """Returns the views that could be shown, and logs all notes and errors."""
    notes, views = outcome
    for note in notes:
        ToolboxRegistry.warning(note)
    shown = []
    for name, tables, files, remarks, error in views:
        for remark in remarks if error is None else [*remarks, error]:
            ToolboxRegistry.warning(remark)
        if error is None:
            shown.append(Shown(name, tables, [Path(file) for file in files], remarks))
    return shown
