"""Animations of episodes."""

from __future__ import annotations

from pogema_rs._forward import modules

# `import pogema` imports these modules too.
__getattr__, __dir__ = modules(__name__, ("animation_drawer", "animation_wrapper", "svg_objects"))
