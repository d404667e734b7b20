"""A port that reports metrics in every step, not only at the end of an episode."""

import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "ports"))
from template import answer as template_answer


def answer(question: dict[str, Any]) -> dict[str, Any]:
    """Answers one question."""
    given = template_answer(question)
    if question["type"] == "hello":
        return {**given, "profiles": [*given["profiles"], "metrics"], "metrics": ["ISR"]}
    return {**given, "metrics": {"ISR": 0.5}} if "rewards" in given else given
