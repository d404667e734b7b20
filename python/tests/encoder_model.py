"""A plain model of encoders: windows and scalars from the map, the cells and the goals, channel by channel."""

from collections import deque

import numpy as np

NEIGHBOURS = [(-1, 0), (1, 0), (0, -1), (0, 1)]


def distances(obstacles, goal):
    """Returns the steps to a goal from each free cell that reaches it, by breadth-first search."""
    found, queue = {goal: 0}, deque([goal])
    if obstacles[goal]:
        return {}
    while queue:
        row, col = queue.popleft()
        for down, right in NEIGHBOURS:
            cell = row + down, col + right
            inside = 0 <= cell[0] < obstacles.shape[0] and 0 <= cell[1] < obstacles.shape[1]
            if inside and not obstacles[cell] and cell not in found:
                found[cell] = found[row, col] + 1
                queue.append(cell)
    return found


class PlainEncoder:
    """Encodes the states of one environment.

    `surroundings` is the map with a border of `border` cells, as POGEMA's grid shows it.
    """

    def __init__(self, encoder, surroundings, border, exact):
        self.encoder, self.exact = encoder, exact
        height, width = (length - 2 * border for length in surroundings.shape)
        self.map = surroundings[border : border + height, border : border + width] != 0
        self.around = {
            (row - border, col - border): int(value) for (row, col), value in np.ndenumerate(surroundings != 0)
        }
        self.starts = self.marks = self.places = None
        self.seen, self.goals, self.best, self.costs = {}, {}, {}, {}

    def follow(self, cells, goals, active):
        """Advances to a state."""
        self.cells, self.goals_now, self.active = cells, goals, active
        if self.starts is None:
            self.starts, self.marks, self.places = cells, set(), {}
        if self.exact:
            self.marks, self.places = set(), {}
        for agent, (cell, is_active) in enumerate(zip(cells, active)):
            if agent in self.places:
                self.marks.discard(self.places.pop(agent))
            if is_active:
                self.marks.add(cell)
                self.places[agent] = cell
        for agent, (cell, goal) in enumerate(zip(cells, goals)):
            if self.goals.get(agent) != goal:
                self.goals[agent], self.best[agent] = goal, None
                self.costs[agent] = distances(self.map, goal)
            now = self.costs[agent].get(cell)
            if now is not None:
                self.best[agent] = now if self.best[agent] is None else min(self.best[agent], now)
            if active[agent]:
                for place in self.places_around(cell, self.encoder.sight):
                    if self.around.get(place, 0):
                        self.seen.setdefault(agent, set()).add(place)

    @staticmethod
    def places_around(cell, radius):
        span = range(-radius, radius + 1)
        return [(cell[0] + down, cell[1] + right) for down in span for right in span]

    def windows(self):
        """Returns the windows of all agents."""
        channels, side, _ = self.encoder.shape
        all_windows = np.zeros((len(self.cells), *self.encoder.shape), np.float32)
        for agent in range(len(self.cells)):
            if self.active[agent]:
                for channel, name in enumerate(self.encoder.channels):
                    values = getattr(self, name)(agent)
                    all_windows[agent, channel] = np.array(values, np.float32).reshape(side, side)
        return all_windows

    def shown(self, agent):
        return self.places_around(self.cells[agent], self.encoder.radius)

    def obstacles(self, agent):
        return [self.around.get(place, 0) for place in self.shown(agent)]

    def agents(self, agent):
        return [place in self.marks for place in self.shown(agent)]

    def seen_agents(self, agent):
        seen = set(self.places_around(self.cells[agent], self.encoder.sight))
        return [place in self.marks and place in seen for place in self.shown(agent)]

    def all_agents(self, agent):
        present = {cell for cell, is_active in zip(self.cells, self.active) if is_active}
        return [place in present for place in self.shown(agent)]

    def goal(self, agent):
        (row, col), (at, across), radius = self.goals_now[agent], self.cells[agent], self.encoder.radius
        nearest = (min(max(row, at - radius), at + radius), min(max(col, across - radius), across + radius))
        return [place == nearest for place in self.shown(agent)]

    def cost_to_go(self, agent):
        costs, most = self.costs[agent], 2 * self.encoder.radius
        own = costs.get(self.cells[agent])
        if own is None:
            return [-1 for _ in self.shown(agent)]
        nearer = [max(-most, min(most, own - costs[place])) if place in costs else -most for place in self.shown(agent)]
        return np.array(nearer, np.float32) / np.float32(most)

    def cost_tracer(self, agent):
        costs, shown, middle = self.costs[agent], self.shown(agent), len(self.shown(agent)) // 2
        own = costs.get(self.cells[agent])
        if own is None:
            return [-1 if place == middle else 0 for place in range(len(shown))]
        known = [costs[place] for place in shown if place in costs]
        farthest = max(known) + (4 if len(known) < len(shown) else 0)
        nearer = [farthest - costs.get(place, farthest) for place in shown]
        values = np.array(nearer, np.float32) / np.float32(farthest - min(known))
        behind = np.float32(own - self.best[agent] + 1) / np.float32(64)
        values[middle] = -min(np.float32(1), behind)
        return values

    def path(self, agent):
        costs, at, path = self.costs[agent], self.cells[agent], set()
        shown = set(self.shown(agent))
        while at in costs and at in shown:
            path.add(at)
            around = [(at[0] + down, at[1] + right) for down, right in NEIGHBOURS]
            at = next((place for place in around if costs.get(place) == costs[at] - 1), None)
        return [place in path for place in self.shown(agent)]

    def seen_obstacles(self, agent):
        return [place in self.seen.get(agent, ()) for place in self.shown(agent)]

    def scalars(self):
        """Returns the scalars of all agents."""
        all_scalars = np.zeros((len(self.cells), 2 * len(self.encoder.scalars)), np.float32)
        for agent in range(len(self.cells)):
            if self.active[agent]:
                for kind, name in enumerate(self.encoder.scalars):
                    all_scalars[agent, 2 * kind : 2 * kind + 2] = self.numbers(name, agent)
        return all_scalars

    def numbers(self, name, agent):
        start, cell, goal = (np.array(cells[agent]) for cells in (self.starts, self.cells, self.goals_now))
        offset = {"position": cell - start, "goal_position": goal - start}.get(name, goal - cell)
        if name == "goal_direction":
            length = max(np.sqrt(np.float32((offset**2).sum())), np.float32(1))
            return offset.astype(np.float32) / length
        return offset.astype(np.float32) / np.maximum(np.abs(offset), 64).astype(np.float32)
