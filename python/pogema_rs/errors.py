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
    "BlockedCellError",
    "ElapsedStepsError",
    "EmptyMapError",
    "InstanceError",
    "InternalError",
    "JumpedError",
    "MapShapeError",
    "MapTextError",
    "MissingSuiteError",
    "NoCellError",
    "NoHistoryError",
    "NotKeptError",
    "NotResetError",
    "OutsideMapError",
    "OverrideError",
    "RejectedConfigError",
    "StateError",
    "UnknownIntegrationError",
]


class _Quiet(KeyError):
    """A KeyError that shows its message without quotes."""

    def __str__(self) -> str:
        return ValueError.__str__(self)


class RejectedConfigError(ValueError):
    """An invalid value in a config field; `GridConfig` raises it as pydantic's ValidationError."""

    def __init__(self, message: str, field: Optional[str] = None, reason: Optional[str] = None) -> None:
        super().__init__(message)
        #: The wrong field, or `None` if the error is not about a single field.
        self.field = field
        #: The message without the prefix `config:`.
        self.reason = message if reason is None else reason


class OutsideMapError(IndexError, ValueError):
    """A start or goal outside the map."""


class NoCellError(IndexError, ValueError):
    """An empty list of goals for an agent."""


class EmptyMapError(ZeroDivisionError, ValueError):
    """A map without cells."""


class MapShapeError(AssertionError, ValueError):
    """A map text with rows of unequal length, or with unequal numbers of starts and goals.

    Also a side of a generated map that is not positive.
    """


class BlockedCellError(_Quiet, ValueError):
    """A start or goal on an obstacle."""


class MapTextError(_Quiet, ValueError):
    """A map text with an unknown character, or with letters in addition to other starts and goals.

    Also an unknown or duplicate name of a registered map.
    """


class InstanceError(OverflowError, IndexError, ValueError):
    """A config without an instance: the map has no room, or starts and goals do not match."""


class InternalError(RuntimeError):
    """A defect of this package; please report it. The object that was called may be in any state."""


class ActionCountError(AssertionError, ValueError):
    """A number of actions that differs from the number of agents."""


class ActionError(IndexError, ValueError):
    """A number that is not an action."""


class NotResetError(ResetNeeded, AttributeError):
    """A call before the first reset."""


class StateError(ValueError, RuntimeError):
    """A call that the current state does not allow."""


class NoHistoryError(NotResetError, TypeError):
    """A call that needs the history, before the first reset."""


class NotKeptError(StateError, AttributeError):
    """A call that needs the history, without `persistent` in the config."""


class ElapsedStepsError(AssertionError, ValueError):
    """A negative number of elapsed steps."""


class JumpedError(IndexError, ValueError):
    """An A* agent in a cell that it cannot reach in one step."""


class AutoResetError(_Quiet, ValueError):
    """`auto_reset` with an integration that does not support it."""


class OverrideError(StateError, TypeError):
    """A method that a subclass overrides, although it is never called."""


class MissingSuiteError(FileNotFoundError, AssertionError):
    """A folder of results without the suite that was played."""


class UnknownIntegrationError(_Quiet, ValueError):
    """An unknown integration."""
