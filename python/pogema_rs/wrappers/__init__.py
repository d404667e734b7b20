"""Wrappers around environments."""

from pogema_rs.wrappers.forwarding import Wrapper

__all__ = ["Wrapper"]
