"""Trains one policy on shortest paths for each goal mode and collision system. All agents share the policy.

Uses POGEMA as the training of the public repository AIRI-Institute/learn-to-follow does:

- a config that contains a `GridConfig`
- several wrappers per environment, one of which changes the map at each reset
- observations that wrappers change in place
- several environments that act as one
- steps that also begin the next episode
"""

import hashlib
import json
import re
from collections import defaultdict, deque
from copy import deepcopy
from typing import Optional

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict
from pogema import GridConfig, pogema_v0
from pydantic import BaseModel, Extra

MAPS = {
    "hall-a": "..........\n.###.####.\n.#......#.\n.#.####.#.\n....##....\n.#......#.\n.########.\n..........",
    "hall-b": "....#.....\n.##...###.\n.##.#.###.\n....#.....\n.##...###.\n....#.....",
    "open": "\n".join(["." * 7] * 7),
}
MOVES = GridConfig().MOVES


class Environment(BaseModel, extra=Extra.forbid):
    grid_config: GridConfig = GridConfig(obs_radius=4, observation_type="POMAPF", max_episode_steps=24)
    target_num_agents: Optional[int] = None
    maps: Optional[str] = None


class Preprocessing(BaseModel, extra=Extra.forbid):
    network_input_radius: int = 2
    subgoal_reward: float = 0.25


class GlobalObstacles(gymnasium.Wrapper):
    def get_global_obstacles(self):
        return self.grid.get_obstacles().astype(int).tolist()

    def get_global_agents_xy(self):
        return self.grid.get_agents_xy()


class MapChanger(gymnasium.Wrapper):
    def __init__(self, env, pattern):
        super().__init__(env)
        self.configs = []
        for name in sorted(MAPS):
            if re.match(pattern, name):
                config = deepcopy(self.grid_config)
                config.map, config.map_name = MAPS[name], name
                self.configs.append(GridConfig(**config.dict()))

    def reset(self, seed=None, **kwargs):
        chosen = deepcopy(self.configs[np.random.default_rng(seed).integers(len(self.configs))])
        self.env.unwrapped.grid_config = chosen
        self.env.unwrapped.grid_config.seed = seed
        return self.env.reset(seed=seed, **kwargs)


def path(obstacles, start, goal):
    """Returns a shortest path between two cells of a grid."""
    came_from, waiting = {start: None}, deque([start])
    while waiting and goal not in came_from:
        cell = waiting.popleft()
        for down, right in MOVES[1:]:
            after = cell[0] + down, cell[1] + right
            if after not in came_from and not obstacles[after[0]][after[1]]:
                came_from[after] = cell
                waiting.append(after)
    cells = [goal] if goal in came_from else []
    while cells and came_from[cells[-1]] is not None:
        cells.append(came_from[cells[-1]])
    return cells[::-1]


class PathDrawer(gymnasium.Wrapper):
    """Draws each agent's path into its window and adds a reward for each subgoal reached."""

    def __init__(self, env, config):
        super().__init__(env)
        self.config = config
        self.subgoals = None

    def observation(self, observations):
        self.reached = []
        subgoals = []
        for agent, seen in enumerate(observations):
            place, goal = tuple(seen["xy"]), tuple(seen["target_xy"])
            first = self.origin[agent]
            here, there = ((cell[0] + first[0], cell[1] + first[1]) for cell in (place, goal))
            cells = path(self.grid_obstacles, here, there)
            self.reached.append(self.subgoals is not None and here == self.subgoals[agent])
            subgoals.append(cells[1] if len(cells) > 1 else there)
            seen["obstacles"][seen["obstacles"] > 0] *= -1
            radius = seen["obstacles"].shape[0] // 2
            for row, col in cells:
                row, col = row - here[0] + radius, col - here[1] + radius
                if not (0 <= row <= 2 * radius and 0 <= col <= 2 * radius):
                    break
                seen["obstacles"][row, col] = 1.0
        self.subgoals = subgoals
        return observations

    def reset(self, **kwargs):
        observations, infos = self.env.reset(**kwargs)
        self.grid_obstacles, self.subgoals = self.get_global_obstacles(), None
        # The positions in observations are relative to the start.
        places = self.get_global_agents_xy()
        self.origin = [
            (place[0] - seen["xy"][0], place[1] - seen["xy"][1]) for place, seen in zip(places, observations)
        ]
        return self.observation(observations), infos

    def step(self, action):
        observations, rewards, terminated, truncated, infos = self.env.step(action)
        observations = self.observation(observations)
        for agent, reached in enumerate(self.reached):
            rewards[agent] += self.config.subgoal_reward if reached else 0.0
        return observations, rewards, terminated, truncated, infos


class WindowCropper(gymnasium.ObservationWrapper):
    def __init__(self, env, radius):
        super().__init__(env)
        side = self.env.observation_space["obstacles"].shape[0]
        self.cut = slice(side // 2 - radius, side // 2 + radius + 1)
        for key, space in self.observation_space.items():
            if space.shape == (side, side):
                self.observation_space[key] = Box(0.0, 1.0, shape=(2 * radius + 1,) * 2)

    def observation(self, observations):
        for seen in observations:
            for key in ("obstacles", "agents"):
                seen[key] = seen[key][self.cut, self.cut]
        return observations


class WindowStacker(gymnasium.ObservationWrapper):
    def __init__(self, env):
        super().__init__(env)
        spaces = self.env.observation_space
        side = spaces["obstacles"].shape[0]
        self.joined = sorted((key for key in spaces if spaces[key].shape == (side, side)), reverse=True)
        self.observation_space = Dict(obs=Box(-1.0, 1.0, shape=(len(self.joined), side, side)), xy=spaces["xy"])

    def observation(self, observations):
        for seen in observations:
            windows = np.concatenate([seen.pop(key)[None] for key in self.joined]).astype(np.float32)
            for key in seen:
                seen[key] = np.array(seen[key], dtype=np.float32)
            seen["obs"] = windows
        return observations


class AutoReset(gymnasium.Wrapper):
    def __init__(self, env):
        super().__init__(env)
        self.rng = np.random.default_rng(self.grid_config.seed)

    def step(self, action):
        observations, rewards, terminated, truncated, infos = self.env.step(action)
        if all(terminated) or all(truncated):
            observations, _ = self.env.reset(seed=int(self.rng.integers(1000)))
        return observations, rewards, terminated, truncated, infos


def make_env(config, preprocessing):
    env = GlobalObstacles(pogema_v0(grid_config=config.grid_config))
    if config.maps:
        env = MapChanger(env, config.maps)
    env = PathDrawer(env, preprocessing)
    return AutoReset(WindowStacker(WindowCropper(env, preprocessing.network_input_radius)))


class ManyEnvs(gymnasium.Wrapper):
    """Several environments that act as one environment with the agents of all of them."""

    def __init__(self, config, preprocessing):
        count = (config.target_num_agents or config.grid_config.num_agents) // config.grid_config.num_agents
        self.envs = [make_env(config, preprocessing) for _ in range(count)]
        super().__init__(self.envs[0])

    def reset(self, seed, **kwargs):
        return [seen for index, env in enumerate(self.envs) for seen in env.reset(seed=seed + index, **kwargs)[0]], {}

    def step(self, actions):
        results, first = ([], [], [], [], []), 0
        for env in self.envs:
            count = env.get_num_agents()
            for joined, values in zip(results, env.step(actions[first : first + count])):
                joined.extend(values)
            first += count
        return results

    def sample_actions(self):
        return np.concatenate([env.sample_actions() for env in self.envs])

    @property
    def num_agents(self):
        return sum(env.get_num_agents() for env in self.envs)


class Learner:
    """Learns the value of each action, given the 3 x 3 cells around an agent."""

    def __init__(self, seed):
        self.values = defaultdict(lambda: [0.0] * len(MOVES))
        self.rng = np.random.default_rng(seed)

    @staticmethod
    def key(seen):
        centre = seen["obs"].shape[1] // 2
        cut = seen["obs"][:, centre - 1 : centre + 2, centre - 1 : centre + 2]
        return cut.astype(np.int8).tobytes()

    def act(self, keys):
        greedy = [int(np.argmax(self.values[key])) for key in keys]
        return [int(self.rng.integers(5)) if self.rng.random() < 0.2 else action for action in greedy]

    def learn(self, keys, actions, rewards, done, after):
        for agent, (key, action) in enumerate(zip(keys, actions)):
            target = rewards[agent] + (0.0 if done[agent] else 0.9 * max(self.values[after[agent]]))
            self.values[key][action] += 0.25 * (target - self.values[key][action])


def train(config, seed, num_steps=300):
    """Trains one policy and returns what it read from the environments and the values that it learned."""
    env, learner = ManyEnvs(config, Preprocessing()), Learner(seed)
    observations, _ = env.reset(seed=seed)
    episodes, log, seen_bytes = [], [], hashlib.sha256()
    for _ in range(num_steps):
        keys = [learner.key(seen) for seen in observations]
        actions = learner.act(keys)
        played = list(actions)
        observations, rewards, terminated, truncated, infos = env.step(actions)
        learner.learn(keys, played, rewards, terminated, [learner.key(seen) for seen in observations])
        for seen in observations:
            seen_bytes.update(seen["obs"].tobytes() + seen["xy"].tobytes() + seen["target_xy"].tobytes())
        log.append([rewards, sum(terminated), sum(truncated), [bool(info["is_active"]) for info in infos]])
        episodes += [info["metrics"] for info in infos if "metrics" in info]
    values = {key.hex(): row for key, row in sorted(learner.values.items())}
    spaces = [str(env.observation_space["obs"].shape), int(env.action_space.n), env.num_agents]
    sampled = env.sample_actions().tolist()
    return [spaces, sampled, episodes, log, seen_bytes.hexdigest(), len(values), values]


def main():
    trained = {}
    for on_target in ("finish", "nothing", "restart"):
        for collisions, maps, agents in (("priority", None, None), ("soft", "hall", 9), ("block_both", "open", 6)):
            config = Environment(maps=maps, target_num_agents=agents)
            config.grid_config.on_target, config.grid_config.collision_system = on_target, collisions
            config.grid_config.num_agents, config.grid_config.seed = 3, len(trained)
            trained[f"{on_target} {collisions}"] = train(config, seed=len(trained))
    with open("trained.json", "w") as file:
        json.dump(trained, file, default=float)


if __name__ == "__main__":
    main()
