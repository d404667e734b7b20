"""The learning curve of a training run, written as CSV, as SVG and for TensorBoard."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

from pogema_rs._files import replaced
from pogema_rs._optional import import_optional


def score_of(on_target: tuple[str, ...]) -> str:
    """Returns the metric that chooses the best weights: `avg_throughput` if every rule is `restart`, `ISR` if none is,
    otherwise `reward`."""
    scores = {"avg_throughput" if rule == "restart" else "ISR" for rule in on_target}
    return scores.pop() if len(scores) == 1 else "reward"


class Curve:
    """The rows of a learning curve: one for each validation."""

    def __init__(self, score: str) -> None:
        self.score = score
        self.rows: list[dict[str, float]] = []

    @property
    def best(self) -> float:
        """The best score so far, or minus infinity."""
        return max((row[self.score] for row in self.rows), default=float("-inf"))

    def write(self, folder: Path, title: str, drawn: bool) -> None:
        """Writes `curve.csv` and, if `drawn`, `curve.svg` into a folder.

        Errors: ImportError without Matplotlib, if `drawn`; OSError if a file cannot be written.
        """
        if not self.rows:
            return
        text = io.StringIO()
        names = list(dict.fromkeys(name for row in self.rows for name in row))
        writer = csv.DictWriter(text, names, lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: _text(value) for name, value in row.items()} for row in self.rows)
        with replaced(folder / "curve.csv") as file:
            file.write(text.getvalue().encode())
        if drawn:
            drawing = self._svg(title)
            with replaced(folder / "curve.svg") as file:
                file.write(drawing)

    def _svg(self, title: str) -> bytes:
        figures = import_optional("matplotlib.figure", "drawing the learning curve")
        figure = figures.Figure(figsize=(6, 3.6))
        axes = figure.add_subplot()
        minutes = [row["minutes"] for row in self.rows]
        scores = [row[self.score] for row in self.rows]
        axes.plot(minutes, scores, color="#c1433c")
        axes.set(xlabel="minutes", ylabel=f"{self.score} on validation episodes", title=title)
        # Rewards may be negative.
        if min(scores) >= 0:
            axes.set_ylim(bottom=0)
        axes.spines[["top", "right"]].set_visible(False)
        figure.tight_layout()
        buffer = io.BytesIO()
        figure.savefig(buffer, format="svg")
        return buffer.getvalue()


def _text(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value:.6g}"


def open_tensorboard(folder: Path) -> Any:
    """Returns a writer of TensorBoard's files.

    Errors: ImportError without TensorBoard.
    """
    import_optional("tensorboard", "--tensorboard")
    return import_optional("torch.utils.tensorboard", "--tensorboard").SummaryWriter(str(folder / "tensorboard"))
