"""Evaluations: many episodes of many algorithms, from one YAML file to results that can be resumed.

    from pogema_rs.toolbox.evaluator import evaluation
    from pogema_rs.toolbox.registry import ToolboxRegistry

The modules have the names and the interface of pogema-toolbox 0.1.1, over the engine, the suites and the results of
`pogema evaluate`.
"""

from __future__ import annotations

__all__: list[str] = []
