"""The watchdog: limits the time of every request, because POGEMA never terminates on some inputs."""

import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


def read_limit(text: str) -> float:
    """Reads a time limit. Units: seconds. Errors: ValueError for any other text."""
    try:
        limit = float(text)
    except ValueError:
        limit = 0.0
    if not 0 < limit < 1e6:
        raise ValueError(f"POGEMA_ORACLE_TIMEOUT is {text}, expected a number of seconds above 0 and below 1e6")
    return limit


LIMIT = read_limit(os.environ.get("POGEMA_ORACLE_TIMEOUT", "20"))


class Timeout(BaseException):
    """The time limit is exceeded. Not an `Exception`, so that no handler within POGEMA catches it."""


def expire(*_: Any) -> None:
    """Handles the alarm."""
    raise Timeout("the time limit is exceeded")


@contextmanager
def deadline(seconds: float) -> Iterator[None]:
    """Raises Timeout in its body after `seconds`, and again every second in case one was lost. Can be nested."""
    start = time.monotonic()
    outer, _ = signal.setitimer(signal.ITIMER_REAL, seconds, 1.0)
    try:
        yield
    finally:
        rest = max(outer - (time.monotonic() - start), 0.001) if outer else 0.0
        signal.setitimer(signal.ITIMER_REAL, rest, 1.0 if rest else 0.0)


def disarm() -> None:
    """Stops the alarm, which keeps repeating if it fired while `deadline` was exiting."""
    signal.setitimer(signal.ITIMER_REAL, 0)


signal.signal(signal.SIGALRM, expire)
