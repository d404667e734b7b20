"""The errors of pogema_rs.

POGEMA 1.4.0 and its 2.0 line raise different classes for the same mistake; each class here is all of them, so that
whatever a program catches catches ours. Every message is one line: what was wrong, and what was expected.
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
    """A KeyError that shows its message, not the quoted message."""

    def __str__(self) -> str:
        return ValueError.__str__(self)


class RefusedConfigError(ValueError):
    """A field of a config holds what it may not hold; `GridConfig` shows it as pydantic's ValidationError."""

    def __init__(self, message: str, field: Optional[str] = None, reason: Optional[str] = None) -> None:
        super().__init__(message)
        #: The field, if one field alone is wrong.
        self.field = field
        #: The message without the word `config`.
        self.reason = message if reason is None else reason


class OutsideMapError(IndexError, ValueError):
    """A start or goal lies outside the map."""


class NoCellError(IndexError, ValueError):
    """An agent's list of goals is empty."""


class EmptyMapError(ZeroDivisionError, ValueError):
    """A map has no cells."""


class MapTextError(_Quiet, ValueError):
    """A map text holds a character without a meaning, or letters beside other places for agents."""


class InstanceError(OverflowError, IndexError, ValueError):
    """No instance can be made of a config: no room, or starts and goals that do not fit each other."""


class ActionCountError(AssertionError, ValueError):
    """There is not one action for each agent."""


class ActionError(IndexError, ValueError):
    """A number is no action."""


class NotResetError(ResetNeeded, AttributeError):
    """The environment was not reset yet."""


class StateError(ValueError, RuntimeError):
    """A call that the state does not allow."""


class NoHistoryError(NotResetError, TypeError):
    """No step was played yet that could be kept or taken back."""


class NotKeptError(StateError, AttributeError):
    """Steps are kept only with `persistent` in the config."""


class ElapsedStepsError(AssertionError, ValueError):
    """There is no such number of steps."""


class JumpedError(IndexError, ValueError):
    """An A* agent is told of a place that it cannot have come to in one step."""


class AutoResetError(_Quiet, ValueError):
    """`auto_reset` with an integration that knows none."""


class UnknownIntegrationError(_Quiet, ValueError):
    """An integration that there is not."""
