"""The agents' random streams of goals, as NumPy generators."""

from __future__ import annotations

import json
from typing import Any, Optional

import numpy as np

from pogema_rs._counted import counted
from pogema_rs._engine import Engine

# NumPy's name for the bit generator that POGEMA uses.
_NAME = "PCG64"


class GoalGenerators:
    """NumPy generators that an engine draws from.

    The engine has its own copies. A `with` block plays one step. Before the step, the copies take the states of the
    NumPy generators. After it, the NumPy generators take the states of the copies, even if a warning about the step
    becomes an error.

    Rule: seed/goals
    """

    def __init__(self, engine: Engine, seed: Optional[int], num_agents: int) -> None:
        self._engine = engine
        # If the engine returns no states, the goals are given in the config, and nothing draws from the generators.
        self._is_drawn = engine.goal_generators() is not None
        seeds = np.random.default_rng(seed).integers(np.iinfo(np.int32).max, size=num_agents)
        self.generators = [np.random.default_rng(seed) for seed in seeds]
        self._read()

    def __enter__(self) -> None:
        """Writes the states into the engine.

        Errors: `TypeError` for a value that is not a generator that uses PCG64, `ValueError` for a wrong number of
        generators and for a generator that two agents share.
        """
        if self._is_drawn:
            self._engine.set_goal_generators([_saved(state) for state in self._states()])

    def __exit__(self, *_: object) -> None:
        self._read()

    def _read(self) -> None:
        for generator, saved in zip(self.generators, self._engine.goal_generators() or []):
            generator.bit_generator.state = _numpy(saved)

    def _states(self) -> list[dict[str, Any]]:
        if not isinstance(self.generators, list):
            raise TypeError(
                f"`random_generators` has type `{_kind(self.generators)}`, expected a list of NumPy generators"
            )
        got, num_agents = len(self.generators), len(self._engine.active)
        if got != num_agents:
            expected = f"{num_agents}, one for each agent"
            raise ValueError(f"`random_generators` has {counted(got, 'generator')}, expected {expected}")
        owners: dict[int, int] = {}
        for agent, generator in enumerate(self.generators):
            source = generator.bit_generator if isinstance(generator, np.random.Generator) else None
            if not isinstance(source, np.random.PCG64):
                kind = _kind(generator if source is None else source)
                raise TypeError(
                    f"`random_generators[{agent}]` has type `{kind}`, expected a generator that uses `{_NAME}`"
                )
            owner = owners.setdefault(id(source), agent)
            if owner != agent:
                text = f"`random_generators[{agent}]` is also `random_generators[{owner}]`, expected one for each agent"
                raise ValueError(text)
        return [dict(generator.bit_generator.state) for generator in self.generators]


def _kind(value: object) -> str:
    return type(value).__name__


def _saved(state: dict[str, Any]) -> str:
    numbers = {"state": state["state"]["state"], "increment": state["state"]["inc"]}
    return json.dumps({"pcg": numbers, "upper_half": state["uinteger"] if state["has_uint32"] else None})


def _numpy(saved: str) -> dict[str, Any]:
    state = json.loads(saved)
    numbers = {"state": state["pcg"]["state"], "inc": state["pcg"]["increment"]}
    half = state["upper_half"]
    return {"bit_generator": _NAME, "state": numbers, "has_uint32": int(half is not None), "uinteger": half or 0}
