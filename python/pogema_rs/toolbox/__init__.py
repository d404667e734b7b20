"""Plays the episodes of all algorithms of a suite, which is one YAML file, and resumes interrupted runs.

    from pogema_rs.toolbox.evaluator import evaluation
    from pogema_rs.toolbox.registry import ToolboxRegistry

The modules have the names and the interface of pogema-toolbox 0.1.1. They run the code of `pogema evaluate`, and use
its formats of suites and results.
"""

from __future__ import annotations

__all__: list[str] = []

#: The release of pogema-toolbox whose interface this package has.
__version__ = "0.1.1"
