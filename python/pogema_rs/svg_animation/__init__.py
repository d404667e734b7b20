"""Animations of episodes."""

from __future__ import annotations

from pogema_rs._forward import modules

# In POGEMA, `import pogema` already imports these modules. Here, they are imported at their first use.
__getattr__, __dir__ = modules(__name__, ("animation_drawer", "animation_wrapper", "svg_objects"))
