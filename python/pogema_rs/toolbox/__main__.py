"""Plays a suite from the command line: `python -m pogema_rs.toolbox SUITE --out FOLDER --register policies.py`."""

from __future__ import annotations

import argparse
import runpy
import sys

from pogema_rs.toolbox.evaluator import EvaluationError, evaluation
from pogema_rs.toolbox.registry import ToolboxRegistry

__all__ = ["main"]


def main(arguments: list[str] | None = None) -> None:
    """Plays the missing episodes of a suite and shows its views.

    Errors: SystemExit with a one-line message for any error.
    """
    parser = argparse.ArgumentParser(prog="python -m pogema_rs.toolbox", description="Play all episodes of a suite.")
    parser.add_argument("suite", help="YAML file with environments, algorithms and views")
    parser.add_argument("--out", required=True, metavar="FOLDER", help="folder for the results")
    parser.add_argument(
        "--register", action="append", default=[], metavar="FILE", help="script that registers policies"
    )
    parser.add_argument("--maps", action="append", default=[], metavar="PATH", help="file or folder with maps")
    parser.add_argument("--dask", metavar="ADDRESS", help="scheduler for Dask backends, e.g. tcp://host:8786")
    parser.add_argument("--html", metavar="FILE", help="write a page with tables, plots and replays")
    begin = parser.add_mutually_exclusive_group()
    begin.add_argument("--resume", action="store_const", dest="begin", const="resume", help="continue an earlier run")
    begin.add_argument("--force", action="store_const", dest="begin", const="anew", help="delete earlier results")
    options = parser.parse_args(arguments)
    ToolboxRegistry.setup_logger("INFO")
    try:
        for script in options.register:
            runpy.run_path(script)
        evaluation(
            options.suite,
            options.out,
            begin=options.begin or "new",
            maps=options.maps,
            dask=options.dask,
            html=options.html,
        )
    except (EvaluationError, ValueError, OSError) as error:
        sys.exit(f"error: {error}")


if __name__ == "__main__":
    main()
