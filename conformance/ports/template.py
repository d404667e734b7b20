"""A complete port to copy: a small environment, and the adapter that connects it to the checks.

Replace `Environment` with your own environment, and list its abilities in `CLAIMS`; the adapter can stay unchanged.
docs/PORTING.md explains the questions and answers. Needs Python 3.9 or newer and only the standard library.
"""

import json
import sys
from typing import Any, Optional

# ------------------------------------ The environment. Replace it with yours. --------------------------------------

MOVES = ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1))  # stay, up, down, left, right


class Environment:
    """POGEMA with the collision system `priority`: agents move one after the other.

    Each move takes effect before the next.
    """

    def __init__(self, instance: dict[str, Any]) -> None:
        config = instance["config"]
        if (config["collision"], config["reward"], instance.get("outside", "free")) != ("priority", "own", "free"):
            raise ValueError("the instance uses rules that this port does not claim")
        self.radius, self.max_steps, self.on_goal = config["radius"], config["max_steps"], config["on_goal"]
        self.starts, self.goal_lists = instance["starts"], instance["goals"]
        # A wall one cell wide surrounds the map, and free cells surround the wall, so no window leaves the grid.
        # The cell (row, col) of the map is at [row + radius][col + radius].
        free, width = "0" * (self.radius - 1), len(instance["map"][0])
        rows = [row.replace(".", "0").replace("#", "1") for row in instance["map"]]
        walled = [free + "1" + row + "1" + free for row in ["1" * width, *rows, "1" * width]]
        beyond = ["0" * len(walled[0])] * len(free)
        self.obstacles = [*beyond, *walled, *beyond]

    def reset(self) -> None:
        """Begins a new episode. All agents are active, even an agent that starts on its goal."""
        self.steps = 0
        self.cells = [tuple(cell) for cell in self.starts]
        self.goals = [tuple(goals[0]) for goals in self.goal_lists]
        self.reached = [0] * len(self.cells)  # for each agent, the number of goals it has reached
        self.active = [True] * len(self.cells)

    def step(self, actions: list[int]) -> tuple[list[float], list[bool], list[bool]]:
        """Plays one step; returns rewards, `terminated` and `truncated`."""
        if len(actions) != len(self.cells) or any(action not in range(5) for action in actions):
            raise ValueError(f"expected {len(self.cells)} actions from 0 to 4")  # the state is unchanged
        moves = [MOVES[action] for action in actions]
        taken = {cell for cell, active in zip(self.cells, self.active) if active}
        for agent, ((row, col), (down, right)) in enumerate(zip(self.cells, moves)):
            there = row + down, col + right
            is_free = self.obstacles[there[0] + self.radius][there[1] + self.radius] == "0"
            if self.active[agent] and is_free and there not in taken:
                taken.remove((row, col))
                taken.add(there)
                self.cells[agent] = there
        self.steps += 1
        on_goal = [cell == goal for cell, goal in zip(self.cells, self.goals)]
        paid = [on and active for on, active in zip(on_goal, self.active)]
        terminated = on_goal  # under `finish`, also agents that finished earlier, although they get no more rewards
        if self.on_goal == "nothing":
            paid = terminated = [all(on_goal)] * len(on_goal)
        elif self.on_goal == "restart":
            terminated = [False] * len(on_goal)
        self.arrive([agent for agent, has_arrived in enumerate(paid) if has_arrived])
        return [float(each) for each in paid], terminated, [self.steps >= self.max_steps] * len(on_goal)

    def arrive(self, agents: list[int]) -> None:
        """Applies the effects of reached goals, after all moves and rewards and before observations."""
        for agent in agents:
            if self.on_goal == "finish":
                self.active[agent] = False
            elif self.on_goal == "restart":
                self.reached[agent] += 1
                goals = self.goal_lists[agent]
                self.goals[agent] = tuple(goals[self.reached[agent] % len(goals)])

    def observe(self) -> list[str]:
        """Returns the observation of each agent, also of finished ones, row by row as `0` and `1`.

        An observation holds three windows: obstacles, active agents (the observing agent included) and goal.
        """
        radius, side = self.radius, 2 * self.radius + 1
        marks = [["0"] * len(row) for row in self.obstacles]
        for (row, col), active in zip(self.cells, self.active):
            if active:
                marks[row + radius][col + radius] = "1"
        agents, windows = ["".join(row) for row in marks], []
        for (row, col), (goal_row, goal_col) in zip(self.cells, self.goals):
            rows, cols = slice(row, row + side), slice(col, col + side)
            seen = [line[cols] for grid in (self.obstacles, agents) for line in grid[rows]]
            # A goal outside the window is drawn on its edge: each axis is clamped separately.
            down, right = (min(max(away, -radius), radius) for away in (goal_row - row, goal_col - col))
            before = (radius + down) * side + radius + right
            windows.append("".join(seen) + "0" * before + "1" + "0" * (side * side - before - 1))
        return windows


# ------------------------------- The adapter: turns questions into calls and results into answers. ----------------

CLAIMS: dict[str, Any] = {
    "protocol": "pogema-conform/1",
    "name": "template",
    "version": "1",
    "profiles": ["core", "observations"],
    "collision": ["priority"],
    "on_goal": ["finish", "nothing", "restart"],
    "observation": ["default"],
}


def pack(bits: str) -> str:
    """Packs bits into hexadecimal digits, eight bits per byte. Nested lists of numbers are also valid, but slower."""
    bits += "0" * (-len(bits) % 8)
    return f"{int(bits, 2):0{len(bits) // 4}x}"


def play(environment: Environment, question: dict[str, Any]) -> dict[str, Any]:
    """Executes a `reset` or a `step`; the two answers share the keys of the state."""
    results: dict[str, Any] = {}
    if question["type"] == "reset":
        environment.reset()
    else:
        rewards, terminated, truncated = environment.step(question["actions"])
        results = {"rewards": rewards, "terminated": terminated, "truncated": truncated}
    state = {"cells": environment.cells, "goals": environment.goals, "active": environment.active}
    return {**state, **results, "observations": [pack(bits) for bits in environment.observe()]}


class Port:
    """Answers questions. An error is also an answer."""

    environment: Optional[Environment] = None

    def answer(self, question: dict[str, Any]) -> dict[str, Any]:
        """Answers one question."""
        if question["type"] == "hello":
            return CLAIMS
        try:
            if "instance" in question:  # without an instance, `reset` resets the current environment
                self.environment = None
                self.environment = Environment(question["instance"])
            if self.environment and question["type"] in ("reset", "step") and "config" not in question:
                return play(self.environment, question)
            raise ValueError("this port does not support this question, or no instance was sent yet")
        except Exception as error:  # noqa: BLE001 - a refusal is a valid answer to any question
            return {"error": f"{type(error).__name__}: {error}"}


answer = Port().answer


def main() -> None:
    """Reads one question per line and writes one answer per line, until `bye`."""
    for line in sys.stdin:
        question = json.loads(line)
        if question["type"] == "bye":
            break
        print(json.dumps(answer(question), separators=(",", ":")), flush=True)


if __name__ == "__main__":
    main()
