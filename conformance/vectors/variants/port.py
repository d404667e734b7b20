"""A port that tests the checker; the environment variable VARIANT selects what it does.

`core`, `capitals`, `letters` and `metrics` change the answers of the template; `seeds` answers every question but
`hello` with an error that contains the seed. `run` explains them.
"""

import os
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "ports"))
from template import answer as template_answer

VARIANT = os.environ["VARIANT"]
SEEDING = {
    "profiles": ["core", "seeding"],
    "collision": ["priority"],
    "on_goal": ["finish"],
    "observation": ["default"],
}


def answer(question: dict[str, Any]) -> dict[str, Any]:
    """Answers one question."""
    if VARIANT == "seeds":
        return SEEDING if question["type"] == "hello" else {"error": f"seed {question.get('config', {}).get('seed')}"}
    given = template_answer(question)
    if question["type"] == "hello":
        if VARIANT == "core":
            del given["observation"]
            return {**given, "profiles": ["core"]}
        names = ["ISR"] if VARIANT == "metrics" else []
        return {**given, "profiles": [*given["profiles"], "metrics"], "metrics": names}
    if VARIANT == "metrics" and "rewards" in given:
        given["metrics"] = {"ISR": 0.5}
    if VARIANT in ("capitals", "letters") and "observations" in given:
        first = 1 if VARIANT == "letters" else 0
        given["observations"] = ["z" * first + window[first:].upper() for window in given["observations"]]
    return given
