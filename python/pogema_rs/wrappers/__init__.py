"""Wrappers around environments."""

from __future__ import annotations

from pogema_rs._forward import modules
from pogema_rs.wrappers.forwarding import Wrapper

__all__ = ["Wrapper"]

# In POGEMA, `import pogema` already imports these modules. Here, they are imported at their first use.
__getattr__, __dir__ = modules(__name__, ("metrics", "multi_time_limit", "persistence"))
