"""Random configs, each a pure function of its generator, and the kinds of features that they cover."""

from __future__ import annotations

from typing import Any

import numpy as np

Fields = dict[str, Any]
Cells = list[list[int]]

ON_TARGET = ("finish", "nothing", "restart")
COLLISIONS = ("priority", "block_both", "soft")
OBSERVATIONS = ("default", "POMAPF", "MAPF")
MAPS = ("registered", "size", "size", "rectangle", "default", "text", "letters", "pools", "list")
PLACES = ("drawn", "drawn", "explicit", "sequences", "pools", "half")


class Draw:
    """Draws configs with one generator, and records the kinds of features drawn."""

    def __init__(self, generator: np.random.Generator) -> None:
        self.generator = generator
        self.kinds: set[str] = set()
        self.registered: tuple[str, str] | None = None

    def chance(self, probability: float) -> bool:
        """Returns True with the given probability."""
        return bool(self.generator.random() < probability)

    def number(self, low: int, high: int) -> int:
        """Returns an integer from low to high, both included."""
        return int(self.generator.integers(low, high + 1))

    def one(self, choices: Any) -> Any:
        """Returns a random element of a sequence."""
        return choices[self.number(0, len(choices) - 1)]

    def note(self, kind: str) -> None:
        """Records a kind of feature as covered."""
        self.kinds.add(kind)

    def config(self) -> Fields:
        """Returns the fields of a config that should be playable."""
        fields: Fields = {"on_target": self.one(ON_TARGET), "obs_radius": self.number(1, 6)}
        for name, choices in (("collision_system", COLLISIONS), ("observation_type", OBSERVATIONS)):
            fields[name] = self.one(choices)
            self.note(f"{name} {fields[name]}")
        self.note(f"on_target {fields['on_target']}")
        self.note(f"radius {fields['obs_radius']}")
        fields["max_episode_steps"] = self.one((1, 2, 3, 5, 8, 12, 12, 64))
        fields["seed"] = self.one((self.number(0, 99), self.number(0, 2**32), self.number(2**32, 2**63 - 2)))
        if self.chance(0.25):
            fields["empty_outside"] = False
            self.note("empty_outside False")
        if self.chance(0.3):
            fields["persistent"] = True
            self.note("persistent")
        rows = self._map(fields)
        self._places(fields, rows)
        if self.chance(0.04) and fields["on_target"] != "restart":
            fields["max_episode_steps"] = self.one((0, -3))
            self.note("no steps")
        return fields

    def _map(self, fields: Fields) -> list[str]:
        """Chooses the map and returns its rows; if the package draws the map, the rows have no obstacles."""
        kind = self.one(MAPS)
        self.note(f"map {kind}")
        if kind in ("size", "rectangle", "default"):
            height = width = 8
            if kind == "size":
                height = width = fields["size"] = self.number(2, 7)
            elif kind == "rectangle":
                height, width = self.number(1, 7), self.number(1, 7)
                fields.update(height=height, width=width)
            fields["density"] = self.one((0.0, 0.1, 0.2, 0.3, 0.45) if height * width > 25 else (0.0, 0.1))
            return ["." * width] * height
        height, width = self.number(1 if kind != "registered" else 3, 6), self.number(2, 7)
        if kind == "pools":
            signs, odds = ".#@$!", (0.4, 0.15, 0.2, 0.2, 0.05)
        else:
            signs, odds = ".#", (0.8, 0.2)
        rows = ["".join(self.generator.choice(list(signs), size=width, p=odds)) for _ in range(height)]
        if kind == "letters":
            rows = self._lettered(rows, fields)
        if kind == "registered":
            fields["map_name"] = "registered"
            self.registered = ("registered", "\n".join(rows))
        elif kind == "list":
            fields["map"] = [[int(sign == "#") for sign in row] for row in rows]
        else:
            fields["map"] = self.one(("\n", "\n   ", " ")).join(rows)
        return rows

    def _lettered(self, rows: list[str], fields: Fields) -> list[str]:
        """Puts pairs of letters on the map."""
        if fields["on_target"] == "restart":
            fields["on_target"] = "nothing"
            self.note("on_target nothing")
        cells = [(row, col) for row, line in enumerate(rows) for col in range(len(line))]
        self.generator.shuffle(cells)
        signs = [list(row) for row in rows]
        for index in range(min(self.number(1, 4), len(cells) // 2)):
            for sign, place in zip(("abcd"[index], "ADBC"[index]), (2 * index, 2 * index + 1)):
                row, col = cells[place]
                signs[row][col] = sign
        return ["".join(row) for row in signs]

    def _places(self, fields: Fields, rows: list[str]) -> None:
        kind = self.one(PLACES)
        num_cells = sum(len(row) for row in rows)
        cells = [[row, col] for row, line in enumerate(rows) for col in range(len(line))]
        self.generator.shuffle(cells)
        num_agents = self.number(1, max(1, min(6, num_cells // 4)))
        if "map" in fields and isinstance(fields["map"], str) and any(sign.isalpha() for sign in fields["map"]):
            kind = "letters"
        self.note(f"places {kind}")
        if kind != "letters" and not (self.chance(0.1) and kind == "explicit"):
            fields["num_agents"] = num_agents
        if kind in ("explicit", "sequences"):
            fields["agents_xy"] = self._in_container(cells[:num_agents])
            is_single = kind == "explicit" and fields["on_target"] != "restart"
            fields["targets_xy"] = self._goals(cells, num_agents, is_single)
        elif kind == "half":
            self._half(fields, cells, num_agents)
        elif kind == "pools":
            count = min(len(cells), num_agents + self.number(0, 4))
            fields["possible_agents_xy"] = self._in_container(cells[:count])
            self.generator.shuffle(cells)
            fields["possible_targets_xy"] = self._in_container(cells[: max(count, min(len(cells), 2))])

    def _half(self, fields: Fields, cells: Cells, num_agents: int) -> None:
        """Sets only starts or only goals, so that agents are placed at random."""
        what = self.one(("agents_xy", "targets_xy", "possible_targets_xy", "possible_agents_xy"))
        self.note(f"{what} alone")
        if what == "targets_xy":
            fields[what] = self._goals(cells, num_agents, fields["on_target"] != "restart")
        elif what == "possible_targets_xy":
            fields[what] = self._in_container(cells[:5])
        else:
            fields[what] = self._in_container(cells[:num_agents])

    def _goals(self, cells: Cells, num_agents: int, is_single: bool) -> list:
        if is_single:
            return self._in_container([self.one(cells) for _ in range(num_agents)])
        self.note("goal sequences")
        return [self._in_container([self.one(cells) for _ in range(self.number(2, 4))]) for _ in range(num_agents)]

    def _in_container(self, cells: Cells) -> list:
        """Returns the cells as lists or as tuples."""
        if self.chance(0.5):
            self.note("cells as tuples")
            return [(int(row), int(col)) for row, col in cells]
        return [[int(row), int(col)] for row, col in cells]
