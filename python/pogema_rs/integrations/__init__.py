"""Adapters of environments for training frameworks."""

from __future__ import annotations

from pogema_rs._forward import modules

# In POGEMA, `import pogema` already imports these modules. Here, they are imported at their first use.
__getattr__, __dir__ = modules(__name__, ("make_pogema", "pymarl", "sample_factory", "pettingzoo"))
