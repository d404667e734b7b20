"""The error for overridden methods that are never called."""

from __future__ import annotations

from collections.abc import Mapping

from pogema_rs.errors import OverrideError


def reject_overrides(kind: type, instead: Mapping[str, str]) -> None:
    """Raises `OverrideError` if the body of a class defines a method that is never called.

    `instead` holds these methods, each with what a user does instead.
    """
    for name in instead:
        if name in vars(kind):
            raise never_called(kind, name, instead)


def never_called(kind: type, name: str, instead: Mapping[str, str]) -> OverrideError:
    """Returns the error for one method."""
    return OverrideError(f"{kind.__name__} overrides `{name}`, which is never called; {instead[name]}")
