"""Plays a suite from the command line: `python -m pogema_rs.toolbox SUITE --out FOLDER --register policies.py`."""

from __future__ import annotations

import argparse
import runpy
import sys

from pogema_rs.toolbox.evaluator import EvaluationError, evaluation
from pogema_rs.toolbox.registry import ToolboxRegistry

__all__ = ["main"]


def main(arguments: list[str] | None = None) -> None:
    """Plays what is not played yet, and shows it.

    Errors: SystemExit with one line for anything that is wrong.
    """
    parser = argparse.ArgumentParser(prog="python -m pogema_rs.toolbox", description="Play all episodes of a suite.")
    parser.add_argument("suite", help="a YAML file with environments, algorithms and views")
    parser.add_argument("--out", required=True, metavar="FOLDER", help="the folder for the results")
    parser.add_argument("--register", action="append", default=[], metavar="FILE", help="a script that registers policies")
    parser.add_argument("--maps", action="append", default=[], metavar="PATH", help="a file or folder with maps")
    parser.add_argument("--dask", metavar="ADDRESS", help="a scheduler for backends of Dask, such as tcp://host:8786")
    parser.add_argument("--html", metavar="FILE", help="write a page with tables, plots and replays")
    begin = parser.add_mutually_exclusive_group()
    begin.add_argument("--resume", action="store_const", dest="begin", const="resume", help="go on with earlier results")
    begin.add_argument("--force", action="store_const", dest="begin", const="anew", help="delete earlier results")
    wanted = parser.parse_args(arguments)
    ToolboxRegistry.setup_logger("INFO")
    try:
        for script in wanted.register:
            runpy.run_path(script)
        evaluation(
            wanted.suite,
            wanted.out,
            begin=wanted.begin or "new",
            maps=wanted.maps,
            dask=wanted.dask,
            html=wanted.html,
        )
    except (EvaluationError, ValueError, OSError) as error:
        sys.exit(f"error: {error}")


if __name__ == "__main__":
    main()
