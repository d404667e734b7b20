"""The errors of pogema_rs.

POGEMA 1.4.0 and its 2.0 line raise different classes for the same mistake. Each class here derives from all of them,
so that existing `except` clauses work. Every message is one line: what was wrong, and what was expected.
"""

from typing import Optional

from gymnasium.error import ResetNeeded

__all__ = [
    "ActionCountError",
    "ActionError",
    "AutoResetError",
    "ElapsedStepsError",
    "EmptyMapError",
    "InstanceError",
    "JumpedError",
    "MapTextError",
    "NoCellError",
    "NoHistoryError",
    "NotKeptError",
    "NotResetError",
    "OutsideMapError",
    "RefusedConfigError",
    "StateError",
    "UnknownIntegrationError",
]


class _Quiet(KeyError):
    """A KeyError that shows its message without quotes."""

    def __str__(self) -> str:
        return ValueError.__str__(self)


class RefusedConfigError(ValueError):
    """A field of a config has an invalid value; `GridConfig` raises it as pydantic's ValidationError."""

    def __init__(self, message: str, field: Optional[str] = None, reason: Optional[str] = None) -> None:
        super().__init__(message)
        #: The wrong field, or `None` if the error is not about a single field.
        self.field = field
        #: The message without the prefix `config:`.
        self.reason = message if reason is None else reason


class OutsideMapError(IndexError, ValueError):
    """A start or goal lies outside the map."""


class NoCellError(IndexError, ValueError):
    """An agent's list of goals is empty."""


class EmptyMapError(ZeroDivisionError, ValueError):
    """A map has no cells."""


class MapTextError(_Quiet, ValueError):
    """A map text has an unknown character, or has letters in addition to other starts and goals."""


class InstanceError(OverflowError, IndexError, ValueError):
    """A config has no instance: the map has no room, or starts and goals do not match."""


class ActionCountError(AssertionError, ValueError):
    """The number of actions differs from the number of agents."""


class ActionError(IndexError, ValueError):
    """A number is not an action."""


class NotResetError(ResetNeeded, AttributeError):
    """The environment was not reset yet."""


class StateError(ValueError, RuntimeError):
    """A call is not allowed in the current state."""


class NoHistoryError(NotResetError, TypeError):
    """The history is not available, because the environment was not reset yet."""


class NotKeptError(StateError, AttributeError):
    """The call needs the kept steps, and thus `persistent` in the config."""


class ElapsedStepsError(AssertionError, ValueError):
    """A number of elapsed steps is negative."""


class JumpedError(IndexError, ValueError):
    """An A* agent observes itself in a cell that it cannot reach in one step."""


class AutoResetError(_Quiet, ValueError):
    """`auto_reset` is set with an integration that does not support it."""


class UnknownIntegrationError(_Quiet, ValueError):
    """An integration is unknown."""
