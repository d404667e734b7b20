"""Adapters of environments for training frameworks."""

from __future__ import annotations

from pogema_rs._forward import modules

# `import pogema` imports these modules too.
__getattr__, __dir__ = modules(__name__, ("make_pogema", "pymarl", "sample_factory", "pettingzoo"))
