"""Checks an implementation against the test vectors beside this file: python3 check.py PORT.py

PORT.py defines `answer(question)`, which returns the answer to a question, as conformance/ports/template.py does.
Exits with 1 if an answer is wrong or no vector was checked. Needs Python 3.9 or newer and only the standard library.
"""

import hashlib
import json
import runpy
import sys
from pathlib import Path
from string import hexdigits
from typing import Any

DEFAULTS = {"occupancy": ["as_released"], "reward": ["own"]}
OPTIONAL = {"on_goal", "occupied", "padded", "derived", "foretold", "actions_after"}  # compared if the port tells them


def can_play(claims: dict[str, Any], needs: dict[str, Any]) -> bool:
    """Returns whether a port claims all that a vector needs.

    Observation types matter only to the profile `observations`.
    """
    for key, need in needs.items():
        claim = claims.get(key, DEFAULTS.get(key, need if key.startswith("max_") else []))
        is_claimed = set(need) <= set(claim) if isinstance(need, list) else (claim or 0) >= need
        if not is_claimed and (key != "observation" or "observations" in claims["profiles"]):
            return False
    return True


def compared(claims: dict[str, Any], answer: dict[str, Any]) -> dict[str, Any]:
    """Returns the part of an expected answer that a port with these claims gives."""
    left_out = {"error"} | OPTIONAL - set(claims.get("tells", []))
    left_out |= {key for key in ("observations", "metrics") if key not in claims["profiles"]}
    kept = {key: answer[key] for key in answer if key not in left_out}
    if kept.get("metrics"):
        claimed = claims.get("metrics", [])
        kept["metrics"] = {name: kept["metrics"][name] for name in kept["metrics"] if name in claimed}
    return kept


def bits(window: Any) -> str:
    """Returns the values of a window as a text of `0` and `1`, with `?` for each wrong value.

    The window is given as hexadecimal digits or nested lists.
    """
    if isinstance(window, str):
        return "".join(f"{int(digit, 16):04b}" if digit in hexdigits else "?" for digit in window)
    values = [window]
    while any(isinstance(value, list) for value in values):
        values = [each for value in values for each in (value if isinstance(value, list) else [value])]
    return "".join("01"[int(value)] if value in (0, 1) else "?" for value in values) + "0" * (-len(values) % 8)


def is_same(key: str, expected: Any, got: Any) -> bool:
    """Compares an expected value with that of an answer."""
    if isinstance(expected, dict):
        return not expected or isinstance(got, dict) and all(is_same(at, expected[at], got.get(at)) for at in expected)
    if isinstance(expected, list):
        fits = isinstance(got, list) and len(got) == len(expected)
        if key in ("observations", "obstacles", "agents"):
            return fits and [bits(window) for window in got] == [bits(window) for window in expected]
        return fits and all(is_same("", one, other) for one, other in zip(expected, got))
    kinds = {bool: (bool,), int: (int,), float: (int, float)}.get(type(expected), ())
    if type(got) in kinds:
        return bool(abs(expected - got) <= 1e-9 * max(1.0, abs(expected)))
    return not kinds and bool(expected == got)


def first_difference(answer: Any, claims: dict[str, Any], exchanges: list[Any]) -> str:
    """Plays a vector and returns a description of the first wrong answer, or an empty text if there is none."""
    for number, exchange in enumerate(exchanges):
        got, expected = json.loads(json.dumps(answer(exchange["question"]))), exchange["answer"]
        if ("error" in got) != ("error" in expected):
            return f"answer {number} has `error` {got.get('error')!r}, expected {expected.get('error')!r}"
        for key, value in compared(claims, expected).items():
            if not is_same(key, value, got.get(key)):
                return f"answer {number} has `{key}` {got.get(key)}, expected {value}"
    return ""


def main() -> int:
    """Checks all files that the manifest names. Prints the first wrong answer to each vector."""
    folder = Path(__file__).parent
    port = Path(sys.argv[1] if len(sys.argv) == 2 else sys.exit("usage: python3 check.py PORT.py"))
    sys.path.insert(0, str(port.parent))
    answer = runpy.run_path(str(port))["answer"]
    claims = answer({"type": "hello", "protocol": "pogema-conform/1"})
    counts = dict.fromkeys(["passed", "failed", "not played"], 0)
    for file in json.loads((folder / "manifest.json").read_text())["files"]:
        text = (folder / file["path"]).read_bytes()
        if hashlib.sha256(text).hexdigest() != file["sha256"]:
            sys.exit(f"{file['path']} was changed")
        for vector in json.loads(text)["vectors"]:
            is_played = "pogema" not in vector and can_play(claims, vector["needs"])
            wrong = is_played and first_difference(answer, claims, vector["exchanges"])
            counts["failed" if wrong else "passed" if is_played else "not played"] += 1
            if wrong:
                print(f"{file['rule']}: {vector['name']}: {wrong}")
    print(", ".join(f"{number} {what}" for what, number in counts.items()))
    return 1 if counts["failed"] or not counts["passed"] else 0


if __name__ == "__main__":
    sys.exit(main())
