"""The warm start of a training run: a planner says what each agent should do in the states that the agents reach.

Source: Sartoretti et al., "PRIMAL: pathfinding via reinforcement and imitation multi-agent learning", 2019, which
imitates a planner's own episodes; Ross et al., "A reduction of imitation learning and structured prediction to
no-regret online learning", 2011, which labels the states of the learner's episodes, as is done here
"""

from __future__ import annotations

import numpy as np

from pogema_rs import _engine


class Teacher:
    """A planner that knows the whole map and all goals, for the episodes of one call of `Collector.play`."""

    def __init__(self, planner: str, nodes: int, on_target: str, shape: tuple[int, int, int]) -> None:
        """Makes a teacher for episodes of `shape`: steps, lanes and agents.

        Errors: ValueError for a planner that is unknown or does not support such episodes.
        """
        steps, lanes, _ = shape
        self._planners = [make_planner(planner, nodes, on_target, steps) for _ in range(lanes)]
        #: The action of the planner in each state of a record.
        #:
        #: Shape: `(steps, lanes, agents)`, int8
        self.advice = np.zeros(shape, dtype=np.int8)

    def advise(self, step: int, obstacles: np.ndarray, positions: np.ndarray, goals: np.ndarray) -> None:
        """Stores in `advice` the planner's actions in a state, for the given goals.

        Shape: `obstacles` `(lanes, rows, columns)`, `positions` and `goals` `(lanes, agents, 2)`
        """
        num_agents = positions.shape[1]
        for lane, planner in enumerate(self._planners):
            self.advice[step, lane, :num_agents] = planner.act(obstacles[lane], positions[lane], goals[lane])


def cells_ahead(paths: np.ndarray, steps: int) -> np.ndarray:
    """Returns the offsets of the cells `steps` steps ahead on the paths in the agents' windows.

    If a path is shorter, the offset is that of its last cell in the window. The offset is 0 without a path.

    Shape: `paths` `(lanes, agents, side, side)`, bool, each from the centre of the window; the result is
    `(lanes, agents, 2)`, int64
    """
    lanes, agents, side, _ = paths.shape
    radius = side // 2
    reached = np.zeros_like(paths)
    reached[:, :, radius, radius] = True
    front, offsets = reached, np.zeros((lanes, agents, 2), dtype=np.int64)
    for _ in range(steps):
        padded = np.pad(front, ((0, 0), (0, 0), (1, 1), (1, 1)))
        beside = padded[:, :, 2:, 1:-1] | padded[:, :, :-2, 1:-1] | padded[:, :, 1:-1, 2:] | padded[:, :, 1:-1, :-2]
        front = beside & paths & ~reached
        reached = reached | front
        flat = front.reshape(lanes, agents, side * side)
        goes_on, first = flat.any(axis=2), flat.argmax(axis=2)
        offsets[goes_on] = np.stack([first // side - radius, first % side - radius], axis=-1)[goes_on]
    return offsets


def make_planner(planner: str, nodes: int, on_target: str, steps: int) -> _engine.PlanFollower:
    """Returns a planner for episodes with the given `on_target`, with a budget of nodes for each step.

    Errors: ValueError for a planner that is unknown or does not support such episodes.
    """
    lifelong = on_target == "restart"
    return _engine.PlanFollower(planner, (None, nodes), None if lifelong else steps, 1, 0, lifelong)
