"""The command line of the trainers: `python -m pogema_rs.baselines train METHOD --out FOLDER`."""

from __future__ import annotations

import argparse
import importlib
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Optional

from pogema_rs._optional import import_optional
from pogema_rs.baselines._config import METHODS, TrainingConfig, load_config

#: The modules that training imports, besides PyYAML; the extra `train` installs all of them.
_NEEDED = ("torch", "torchrl", "tensordict", "matplotlib", "filelock")


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Runs the command line and returns the exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    given = _parser().parse_args(arguments)
    try:
        if given.command == "config":
            _show(load_config(given.method, given.config, given.set))
        else:
            _train(given, ["python", "-m", "pogema_rs.baselines", *arguments])
    except KeyboardInterrupt:
        has_checkpoint = given.command == "train" and (given.out / "checkpoint.pt").exists()
        print("stopped" + "; --resume continues from the last checkpoint" * has_checkpoint, file=sys.stderr)
        return 130
    except (ImportError, ValueError, TypeError, OSError, MemoryError, OverflowError) as error:
        print(f"{given.command} {given.method}: {_line(error)}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m pogema_rs.baselines", description="Trains learned methods.")
    commands = parser.add_subparsers(dest="command", required=True)
    train = commands.add_parser("train", help="train a method and export its weights")
    show = commands.add_parser("config", help="print the hyperparameters of a method as YAML")
    for command in (train, show):
        command.add_argument("method", metavar="METHOD", help=f"one of {', '.join(METHODS)}")
        command.add_argument("--config", metavar="FILE", help="YAML file of hyperparameters [default: the package's]")
        command.add_argument(
            "--set",
            metavar="SECTION.KEY=VALUE",
            action="append",
            default=[],
            help="replace one hyperparameter; may be repeated",
        )
    train.add_argument("--out", metavar="FOLDER", type=Path, required=True, help="folder of the run")
    default = "[default: with --iterations, no limit; with --resume, that of the run; otherwise 60]"
    train.add_argument("--minutes", type=float, help=f"training time of the whole run in minutes {default}")
    train.add_argument(
        "--iterations",
        type=int,
        help="number of iterations of the whole run, for a reproducible result "
        "[default: with --resume, that of the run; otherwise no limit]",
    )
    train.add_argument("--seed", type=int, default=0, help="seed of the training run [default: 0]")
    train.add_argument("--threads", type=int, default=1, help="number of threads [default: 1]")
    train.add_argument("--resume", action="store_true", help="continue the run in the folder from its checkpoint")
    train.add_argument("--tensorboard", action="store_true", help="also write files for TensorBoard")
    return parser


def _train(given: argparse.Namespace, command: Sequence[str]) -> None:
    for name in ("minutes", "iterations", "threads"):
        value = getattr(given, name)
        if value is not None and not 0 < value < math.inf:
            raise ValueError(f"--{name} is {value}, expected a finite number above 0")
    if not 0 <= given.seed < 2**63:
        raise ValueError(f"--seed is {given.seed}, expected 0 to {2**63 - 1}")
    config = load_config(given.method, given.config, given.set)
    _check_packages()
    from pogema_rs.baselines._run import Budget, train

    budget = None
    if given.minutes is not None or given.iterations is not None:
        budget = Budget(given.minutes, given.iterations)
    elif not given.resume:
        budget = Budget(60.0)
    train(
        config,
        given.out,
        budget,
        seed=given.seed,
        threads=given.threads,
        resume=given.resume,
        tensorboard=given.tensorboard,
        command=command,
    )
    print(f"wrote {given.out / 'weights.safetensors'}")


def _check_packages() -> None:
    """Imports the packages of the extra `train`.

    Errors: ImportError with the command that installs the extra.
    """
    for name in _NEEDED:
        try:
            importlib.import_module(name)
        except ModuleNotFoundError as error:
            raise ImportError(f"training needs {error.name}: pip install 'pogema-rs[train]'", name=name) from None


def _show(config: TrainingConfig) -> None:
    print(import_optional("yaml", "printing hyperparameters").safe_dump(config.to_dict(), sort_keys=False), end="")


def _line(error: BaseException) -> str:
    """Returns the message of an error as one line."""
    if isinstance(error, OSError) and error.filename is not None and error.strerror:
        return f"{error.filename}: {error.strerror}"
    return " ".join(str(error).split())


if __name__ == "__main__":
    sys.exit(main())
