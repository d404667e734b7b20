"""Times the loop of train_ppo.py on an environment. See `training_task.serve`."""

import sys
import time

import gymnasium
import numpy as np
from gymnasium.vector import AsyncVectorEnv

sys.path.insert(0, __file__.rpartition("/")[0])
from training_task import CONFIG, NUM_AGENTS, NUM_ENVS, PARAMS, SIDE, serve, train_ppo


class Team(gymnasium.Env):
    """An environment of POGEMA with a joint action and a joint observation, as AsyncVectorEnv requires.

    AsyncVectorEnv passes on a single reward, so the infos hold the rewards of the agents.
    """

    observation_space = gymnasium.spaces.Box(0, 1, (NUM_AGENTS, 3, SIDE, SIDE), np.float32)
    action_space = gymnasium.spaces.MultiDiscrete([5] * NUM_AGENTS)

    def __init__(self):
        import pogema

        config = pogema.GridConfig(**CONFIG)
        self._moves = [(SIDE // 2 + down, SIDE // 2 + right) for down, right in config.MOVES]
        self._env = pogema.pogema_v0(grid_config=config)

    def reset(self, *, seed=None, options=None):
        seen, infos = self._env.reset(seed=seed)
        return self._of_state(seen, infos, np.zeros(NUM_AGENTS, np.float32))

    def step(self, actions):
        seen, rewards, terminated, truncated, infos = self._env.step(list(actions))
        seen, info = self._of_state(seen, infos, np.array(rewards, np.float32))
        return seen, float(sum(rewards)), all(terminated), all(truncated), info

    def _of_state(self, seen, infos, rewards):
        seen = np.stack(seen)
        masks = np.stack([seen[:, 0, row, col] == 0 for row, col in self._moves], axis=1).astype(np.int8)
        active = np.array([info["is_active"] for info in infos])
        return seen, {"action_masks": masks, "is_active": active, "rewards": rewards}


class PogemaEnvs:
    """POGEMA's environments with the interface of `VecEnv`."""

    def __init__(self):
        self._envs = AsyncVectorEnv([Team] * NUM_ENVS)

    def reset(self, seed):
        seen, infos = self._envs.reset(seed=seed)
        return seen, self._of_infos(infos)

    def step(self, actions):
        seen, _, terminated, truncated, infos = self._envs.step(actions)
        now = self._of_infos(infos)
        rewards = now.pop("rewards")
        if "final_info" in infos:
            ended = np.flatnonzero(infos["_final_info"])
            finals = infos["final_info"]
            rewards[ended] = [finals[env]["rewards"] for env in ended]
            masks = np.zeros_like(now["action_masks"])
            masks[ended] = [finals[env]["action_masks"] for env in ended]
            now |= {"final_obs": infos["final_observation"], "final_info": {"action_masks": masks}}
        ends = (np.repeat(flags[:, None], NUM_AGENTS, axis=1) for flags in (terminated, truncated))
        return seen, rewards, *ends, now

    def close(self):
        self._envs.close()

    def _of_infos(self, infos):
        return {name: np.stack(infos[name]) for name in ("action_masks", "is_active", "rewards")}


class FreeEnvs:
    """Environments that return the same arrays in every step."""

    def __init__(self):
        env = train_ppo.VecEnv(train_ppo.GridConfig(**CONFIG), NUM_ENVS, masks=True)
        self._first = env.reset(seed=0)
        env.close()
        shape = (NUM_ENVS, NUM_AGENTS)
        rewards, ends = np.zeros(shape, np.float32), np.zeros(shape, np.bool_)
        self._step = (self._first[0], rewards, ends, ends, self._first[1])

    def reset(self, seed):
        return self._first

    def step(self, actions):
        return self._step

    def close(self):
        pass


class Trainer(train_ppo.Trainer):
    """The training on one of the environments."""

    def __init__(self, name):
        self._name = name
        super().__init__(PARAMS, 0)

    def make_env(self):
        if self._name == "ours":
            config = train_ppo.GridConfig(**CONFIG)
            return train_ppo.VecEnv(config, NUM_ENVS, masks=True)
        return PogemaEnvs() if self._name == "pogema" else FreeEnvs()


def agent_steps_per_second(name, seconds):
    """Returns agent steps per second of the whole loop, without its first iteration."""
    trainer = Trainer(name)
    count, began = -1, time.perf_counter()
    while count < 1 or time.perf_counter() - began < seconds:
        trainer.play()
        trainer.learn(0.0)
        count += 1
        if count == 0:
            began = time.perf_counter()
    spent = time.perf_counter() - began
    trainer.env.close()
    return count * trainer.rollout.actions.numel() / spent


if __name__ == "__main__":
    serve(agent_steps_per_second)
