"""Archives results, and sends them to Weights & Biases."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Union

from pogema_rs._optional import import_optional

__all__ = ["create_and_push_summary_archive", "initialize_wandb", "save_evaluation_results"]

# Whether the last run was begun without uploads, on a machine without wandb.
_is_offline = False


def initialize_wandb(
    evaluation_config: Mapping[str, Any], eval_dir: Path, disable_wandb: bool, project_name: str
) -> None:
    """Begins a run of Weights & Biases; with `disable_wandb` it uploads nothing, and wandb need not be installed.

    Errors: `ImportError` if wandb is needed and missing.

    Source: pogema-toolbox 0.1.1, `eval_utils.py`, `initialize_wandb`
    """
    global _is_offline  # noqa: PLW0603 - wandb has one run for each process too
    _is_offline = bool(disable_wandb) and find_spec("wandb") is None
    if not _is_offline:
        import_optional("wandb", "`initialize_wandb`").init(
            project=project_name,
            anonymous="allow",
            config=evaluation_config,
            mode="disabled" if disable_wandb else "online",
            job_type=Path(eval_dir).stem,
            group="eval",
        )


def save_evaluation_results(eval_dir: Union[str, os.PathLike[str]]) -> None:
    """Writes a folder to `<eval_dir>.zip` and uploads the file to the current run.

    Source: pogema-toolbox 0.1.1, `eval_utils.py`, `save_evaluation_results`
    """
    folder = Path(eval_dir)  # without a slash at the end
    archive = shutil.make_archive(str(folder), "zip", folder)
    if not _is_offline:
        import_optional("wandb", "`save_evaluation_results`").save(archive)


def create_and_push_summary_archive(
    folder_names: Sequence[str], base_path: Path, project_name: str, archive_name: str = "eval_summary"
) -> None:
    """Writes some folders to `<archive_name>.zip` in `base_path`, and uploads the file as an artifact.

    Source: pogema-toolbox 0.1.1, `eval_utils.py`, `create_and_push_summary_archive`
    """
    wandb = import_optional("wandb", "`create_and_push_summary_archive`")
    base_path = Path(base_path)
    with tempfile.TemporaryDirectory() as summary:
        for name in folder_names:
            shutil.copytree(base_path / name, Path(summary, name))
        archive = shutil.make_archive(str(base_path / archive_name), "zip", summary)
    artifact = wandb.Artifact(
        name=archive_name,
        type="archive",
        description="Summary archive",
        metadata={"folder_names": folder_names},
    )
    artifact.add_file(archive)
    with wandb.init(project=project_name) as run:
        run.log_artifact(artifact)
