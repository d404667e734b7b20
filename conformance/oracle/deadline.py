"""The watchdog: POGEMA loops for ever on some inputs, so everything it is asked to do has a time limit."""

import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

LIMIT = float(os.environ.get("POGEMA_ORACLE_TIMEOUT", "20"))
if not 0 < LIMIT < 1e6:
    raise ValueError("POGEMA_ORACLE_TIMEOUT is not a sensible number of seconds")


class Timeout(BaseException):
    """The time is up; not an Exception, so that no handler within POGEMA takes it for its own."""


def expire(*_: Any) -> None:
    """The alarm's handler."""
    raise Timeout("the time limit is over")


@contextmanager
def deadline(seconds: float) -> Iterator[None]:
    """Raises Timeout in its body when the time is up, and again each second if that is lost; may be nested."""
    start = time.monotonic()
    outer, _ = signal.setitimer(signal.ITIMER_REAL, seconds, 1.0)
    try:
        yield
    finally:
        rest = max(outer - (time.monotonic() - start), 0.001) if outer else 0.0
        signal.setitimer(signal.ITIMER_REAL, rest, 1.0 if rest else 0.0)


def disarm() -> None:
    """Stops the alarm, should it have gone off within `deadline`'s own exit."""
    signal.setitimer(signal.ITIMER_REAL, 0)


signal.signal(signal.SIGALRM, expire)
