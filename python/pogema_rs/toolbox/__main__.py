"""Plays a suite from the command line: `python -m pogema_rs.toolbox SUITE --out FOLDER --register policies.py`."""

from __future__ import annotations

import argparse
import os
import sys

from pogema_rs.toolbox._backends import register_by
from pogema_rs.toolbox.evaluator import EvaluationError, evaluation
from pogema_rs.toolbox.registry import ToolboxRegistry

__all__ = ["main"]


def main(arguments: list[str] | None = None) -> None:
    """Plays the missing episodes of a suite and shows its views.

    Errors: SystemExit with a one-line message for a wrong suite, file, folder or option, a missing package, and failed
    episodes. Errors of a registered script keep their tracebacks.
    """
    parser = argparse.ArgumentParser(prog="python -m pogema_rs.toolbox", description="Play all episodes of a suite.")
    parser.add_argument("suite", help="YAML file with environments, algorithms and views")
    parser.add_argument("--out", required=True, metavar="FOLDER", help="folder for the results")
    parser.add_argument(
        "--register",
        action="append",
        default=[],
        metavar="FILE",
        help="run a script that registers policies; may be given several times",
    )
    parser.add_argument(
        "--maps",
        action="append",
        default=[],
        metavar="PATH",
        help="add a file or folder with maps; may be given several times",
    )
    parser.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="scheduler for Dask backends, such as tcp://host:8786 [default: the suite's, else a local cluster]",
    )
    parser.add_argument("--html", metavar="FILE", help="write a page with tables, plots and replays")
    begin = parser.add_mutually_exclusive_group()
    begin.add_argument("--resume", action="store_const", dest="begin", const="resume", help="continue an earlier run")
    begin.add_argument("--force", action="store_const", dest="begin", const="anew", help="delete earlier results")
    options = parser.parse_args(arguments)
    ToolboxRegistry.setup_logger("INFO")
    for script in options.register:
        if not os.path.exists(script):
            sys.exit(f"error: {script}: file not found, expected a script that registers policies")
        register_by(script)
    try:
        evaluation(
            options.suite,
            options.out,
            begin=options.begin or "new",
            maps=options.maps,
            dask=options.dask,
            html=options.html,
        )
    except (EvaluationError, ValueError, OSError, ImportError) as error:
        sys.exit(f"error: {_in_one_line(error)}")


def _in_one_line(error: Exception) -> str:
    """Returns the text of an error; of several invalid fields, only the first one."""
    errors = getattr(error, "errors", None)
    if not callable(errors):
        return str(error)
    first = errors()[0]
    place = ".".join(map(str, first["loc"]))
    return f"{place}: {first['msg']}" if place else str(first["msg"])


if __name__ == "__main__":
    main()
