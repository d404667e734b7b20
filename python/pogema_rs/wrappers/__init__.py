"""Wrappers around environments."""

from __future__ import annotations

from pogema_rs._forward import modules
from pogema_rs.wrappers.forwarding import Wrapper

__all__ = ["Wrapper"]

# `import pogema` imports these modules too.
__getattr__, __dir__ = modules(__name__, ("metrics", "multi_time_limit", "persistence"))
