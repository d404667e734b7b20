"""POGEMA, bit for bit and hundreds of times faster."""

from pogema_rs._engine import __version__
from pogema_rs.grid_config import GridConfig

__all__ = ["GridConfig", "__version__"]
