"""Compares outcomes of POGEMA with ours, and reports where they differ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from configs import Fields
from intended import INTENDED
from player import Outcome
from scripts import Call, Case

_EXPECTED = {difference.name: difference for difference in INTENDED}
_POOLS = ("possible_agents_xy", "possible_targets_xy")


@dataclass
class Difference:
    """A call whose outcomes differ."""

    case: Case
    index: int
    reason: str
    theirs: Any
    ours: Any

    def __str__(self) -> str:
        lines = [f"case {self.case.number}, call {self.index}: {self.reason}", f"  config {self.case.fields}"]
        calls = [call for call in self.case.script[: self.index + 1] if call[0] != "call"]
        lines += [f"  before {calls[-8:]}", f"  call   {self.case.script[self.index]}"]
        return "\n".join([*lines, f"  POGEMA {_shown(self.theirs)}", f"  ours   {_shown(self.ours)}"])


class Comparison:
    """Compares cases, and counts calls and intended differences."""

    def __init__(self) -> None:
        self.num_calls = 0
        self.num_steps = 0
        self.num_errors = 0
        self.num_ends = 0
        self.num_metrics = 0
        self.num_warnings = 0
        self.has_vanished = self.was_reset = False
        self.known: dict[str, int] = {}

    def compare(self, case: Case, theirs: list[Outcome], ours: list[Outcome]) -> Difference | None:
        """Returns the first difference that is not intended, or None."""
        self.has_vanished = self.was_reset = False
        for index, (call, their, our) in enumerate(zip(case.script, theirs, ours)):
            self.num_calls += 1
            if call[0] in ("step", "sample") and "value" in their:
                self._count_step(call, their)
            elif call[0] == "reset":
                self.has_vanished = False
            self.num_errors += "error" in their
            self.num_warnings += len(_warned(their))
            if case.intended and index == len(case.script) - 1:
                return self._compare_intended(case, index, their, our)
            known, ends = self._known(case, call, their, our)
            if known:
                self.known[known] = self.known.get(known, 0) + 1
                if ends:
                    return None
                continue
            reason = _difference(call, their, our)
            if reason:
                return Difference(case, index, reason, their, our)
            if call[0] == "reset" and "error" in their and self.was_reset:
                # In POGEMA a failed reset restarts the time limit and nothing else; here it changes nothing.
                self.known["failed reset"] = self.known.get("failed reset", 0) + 1
                return None
            self.was_reset |= call[0] == "reset" and "value" in their
        if len(theirs) != len(ours):
            return Difference(case, min(len(theirs), len(ours)) - 1, "one of them ended", theirs[-1], ours[-1])
        return None

    def _count_step(self, call: Call, their: Outcome) -> None:
        self.num_steps += 1
        self.has_vanished |= their["value"][1]
        _, (_, _, terminated, truncated, infos) = their["value"][0]
        is_over = any(all(flag == ("bool", "True") for flag in flags[1]) for flags in (terminated, truncated))
        self.num_ends += is_over
        self.num_metrics += "'metrics'" in repr(infos)

    def _compare_intended(self, case: Case, index: int, their: Outcome, our: Outcome) -> Difference | None:
        expected = _EXPECTED[case.intended]
        for side, outcome, error in (("POGEMA", their, expected.theirs), ("ours", our, expected.ours)):
            if _classes(outcome)[:1] != ([error] if error else []):
                reason = f"{case.intended}: expected {error or 'a value'} from {side}"
                return Difference(case, index, reason, their, our)
        if "value" in our and their.get("value") == our["value"]:
            return Difference(case, index, f"{case.intended}: the difference no longer exists", their, our)
        self.known[case.intended] = self.known.get(case.intended, 0) + 1
        return None

    def _known(self, case: Case, call: Call, their: Outcome, our: Outcome) -> tuple[str, bool]:
        """Returns the name of an intended difference, and whether the rest of the case cannot be compared."""
        if _is_masked(call, their) and "ValidationError" in _classes(our):
            # docs/spec/defects.md, Instances and seeds: a KeyError hides what is wrong with the starts.
            return "malformed starts", False
        if "timeout" in their and call[1:2] == ("get_lifelong_targets_xy",) and "would never end" in _text(our):
            # docs/spec/differences.md, Metrics and history: a list of goals whose sum of distances stops growing.
            return "endless list of goals", True
        if call == ("reset", None) and "possible_" in _text(our) and "expected cells inside the map" in _text(our):
            # docs/spec/differences.md, Starts and goals: after a change of the size, a pool has cells outside the map.
            return "pool outside the map", True
        if call[0] in ("reset", "grid") and "map_name" in case.fields and "no room" in _text(our) and "value" in their:
            # docs/spec/differences.md, Maps: POGEMA replaces a registered map without room with a drawn one.
            return "registered map without room", True
        return self._known_in_episode(case, call, their, our)

    def _known_in_episode(self, case: Case, call: Call, their: Outcome, our: Outcome) -> tuple[str, bool]:
        is_soft = "soft" in repr(case.script)
        wrote = "does not support item assignment" in _text(their)
        if call[0] == "step" and is_soft and wrote and call[2] == "tuple" and "value" in our:
            # docs/spec/defects.md, Collisions and occupancy: the caller's actions stay unchanged.
            return "soft writes into a tuple", True
        if call == ("left",) and is_soft and their.get("value") != our.get("value"):
            return "soft writes into the actions", False
        if call[0] == "back" and case.fields.get("persistent") and self.has_vanished:
            # docs/spec/differences.md, Metrics and history: POGEMA loses marks, or raises.
            return "step back after agents have vanished", True
        if call[0] == "back" and is_soft and "already occupied" in _text(their) and "value" in our:
            # POGEMA also raises if an agent finished on a cell that another agent left in the same step.
            return "step back of an agent that followed and finished", True
        if call[0] == "back" and "Can't force agent to blocked position" in _text(their) and _has_pools(case.fields):
            # docs/spec/differences.md, Metrics and history: the start was an obstacle.
            return "step back onto an obstacle", True
        return "", False


def _is_masked(call: Call, their: Outcome) -> bool:
    is_config = call[0] in ("config", "make")
    return is_config and "num_agents" not in call[1] and _text(their) == "'agents_xy'"


def _has_pools(fields: Fields) -> bool:
    """Returns whether a config has a pool of starts, which may lie on obstacles."""
    return "possible_agents_xy" in fields


def _text(outcome: Outcome) -> str:
    return outcome["error"][1] if "error" in outcome else ""


def _classes(outcome: Outcome) -> list[str]:
    return outcome["error"][0] if "error" in outcome else []


def _difference(call: Call, their: Outcome, our: Outcome) -> str:
    """Returns how our outcome is wrong, or an empty string."""
    if "timeout" in their or "timeout" in our:
        return "" if their.keys() == our.keys() else "one of them does not end"
    if ("error" in their) != ("error" in our):
        return "one of them raises"
    if "error" in their:
        expected = _classes(their)[0]
        return "" if expected in _classes(our) else f"our error is not a {expected}"
    if _value(call, their) != _value(call, our):
        return f"the values differ at {_place(_value(call, their), _value(call, our))}"
    if _warned(their) != _warned(our):
        return "the warnings differ"
    return ""


def _value(call: Call, outcome: Outcome) -> Any:
    """Returns the part of a value that must be equal."""
    value = outcome["value"]
    if call[0] in ("dump", "update"):
        # POGEMA shuffles the caller's lists in place; our package keeps their order.
        fields = ((name, (one[0], sorted(one[1])) if _is_pool(name, one) else one) for name, one in value[1])
        return (value[0], tuple(fields))
    if call[0] == "call" and call[1] in ("grid.positions", "grid.obstacles"):
        # Our grid is a read-only view.
        return (*value[:3], value[3][0], value[4])
    return value


def _is_pool(name: Any, value: Any) -> bool:
    return any(name == ("str", repr(pool)) for pool in _POOLS) and isinstance(value[1], tuple)


def _warned(outcome: Outcome) -> list[str]:
    """Returns the kinds of the warnings that both packages give, recognized by words in their texts."""
    phrases = (
        ("cycling back", "round"),
        ("wraps around", "round"),
        ("obstacle on a", "obstacle"),
        ("is on an obstacle", "obstacle"),
    )
    found = [kind for _, text in outcome["warnings"] for phrase, kind in phrases if phrase in text]
    return sorted(found)


def _place(one: Any, other: Any, path: str = "") -> str:
    """Returns the innermost place where two descriptions differ."""
    if not (isinstance(one, tuple) and isinstance(other, tuple) and len(one) == len(other)):
        return f"{path or 'the top'}: {_shown(one)} and {_shown(other)}"
    for index, (left, right) in enumerate(zip(one, other)):
        if left != right:
            return _place(left, right, f"{path}/{index}")
    return path


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 400 else f"{text[:400]} ... ({len(text)} characters)"
