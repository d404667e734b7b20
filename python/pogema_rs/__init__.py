"""POGEMA, bit for bit and hundreds of times faster."""

from pogema_rs._engine import __version__

__all__ = ["__version__"]
