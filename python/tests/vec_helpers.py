"""A model of `VecEnv`: one engine for each environment, reset by hand."""

import numpy as np
from pogema_rs import _engine
from pogema_rs.vec_env import AutoresetMode

CONFIG = {
    "num_agents": 5,
    "size": 7,
    "density": 0.25,
    "obs_radius": 2,
    "max_episode_steps": 9,
    "collision_system": "soft",
    "on_target": "finish",
}


def derived_seed(seed, key):
    """Returns the seed of an episode by the documented rule."""
    state = np.random.SeedSequence(seed, spawn_key=key).generate_state(1, np.uint64)[0]
    return int(state) % (2**63 - 1)


def shared_seed(seed):
    return lambda env, episode: derived_seed(seed, (env, episode))


def own_seeds(seeds):
    return lambda env, episode: seeds[env] if episode == 0 else derived_seed(seeds[env], (episode,))


def actions_of(rng, env):
    """Draws the actions of one step for all environments of a `VecEnv`."""
    return rng.integers(5, size=(env.num_envs, env.num_agents))


class Plain:
    """An environment that is reset by hand; the rows after its agents are padding up to `room` agents."""

    def __init__(self, config, env, seed_of, exact=False, room=None):
        self.config, self.env, self.seed_of, self.exact = config, env, seed_of, exact
        self.room = config["num_agents"] if room is None else room
        self.episode = -1
        self.begin()

    def begin(self):
        self.episode += 1
        self.seed = self.seed_of(self.env, self.episode)
        self.engine = _engine.Engine({**self.config, "seed": self.seed}, None, self.exact)
        self.engine.reset()
        self.num_agents = len(self.engine.active)
        self.last = None

    def padded(self, rows, value=0):
        rows = np.asarray(rows)
        padding = np.full((self.room - self.num_agents, *rows.shape[1:]), value, rows.dtype)
        return np.concatenate([rows, padding])

    def observe(self):
        return self.padded(self.engine.observe())

    def masks(self):
        """Returns the action masks, computed cell by cell."""
        obstacles, masks = self.engine.obstacles(), []
        cells = self.engine.cells(self.config["obs_radius"])
        for (row, col), is_active in zip(cells, self.engine.active):
            around = [(row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)]
            masks.append([1] + [int(is_active and not obstacles[place]) for place in around])
        padding = [[1, 0, 0, 0, 0]] * (self.room - self.num_agents)
        return np.array(masks + padding, dtype=np.int8)

    def state(self):
        """Returns which rows are active agents, and which rows are agents and not padding."""
        return {"active": self.padded(self.engine.active), "agents": np.arange(self.room) < self.num_agents}

    def step(self, mode, actions):
        """Plays one step and returns what `VecEnv` must return, as a dict."""
        was_over, shown = self.last is not None, {}
        if was_over and mode == AutoresetMode.NEXT_STEP:
            self.begin()
        if was_over:
            rewards = np.zeros(self.num_agents)
            terminated, truncated = self.last or np.zeros((2, self.num_agents), bool)
        else:
            _, rewards, terminated, truncated, infos = self.engine.step(actions[: self.num_agents].tolist())
        ends = {
            "rewards": self.padded(rewards),
            "terminated": self.padded(terminated, True),
            "truncated": self.padded(truncated, True),
        }
        if not was_over and (all(terminated) or all(truncated)):
            self.last = (terminated, truncated)
            shown["metrics"] = infos[0]["metrics"]
            if mode == AutoresetMode.SAME_STEP:
                final = {f"final_{name}": value for name, value in self.state().items()}
                shown.update(final_obs=self.observe(), final_masks=self.masks(), **final)
                self.begin_after(shown["metrics"])
        return {**shown, **ends, **self.state(), "obs": self.observe(), "masks": self.masks(), "seed": self.seed}

    def begin_after(self, metrics):
        """Begins the next episode after an episode with these metrics."""
        self.begin()


def reset_ended(env, plain):
    """For the mode `DISABLED`, resets the environments whose episodes ended, and their engines."""
    is_over = np.array([one.last is not None for one in plain])
    if is_over.any():
        env.reset(options={"reset_mask": is_over})
        for one in np.array(plain)[is_over]:
            one.begin()


def check_step(got, plain, mode, actions, seeds, unpack=np.asarray):
    """Compares a step of a `VecEnv` with masks to the same step of engines; returns the number of ended episodes."""
    obs, rewards, terminated, truncated, infos = got
    shown = [one.step(mode, actions[env]) for env, one in enumerate(plain)]
    for env, one in enumerate(shown):
        np.testing.assert_array_equal(unpack(obs[env]), one["obs"])
        np.testing.assert_array_equal(rewards[env], np.array(one["rewards"], np.float32))
        np.testing.assert_array_equal(terminated[env], one["terminated"])
        np.testing.assert_array_equal(truncated[env], one["truncated"])
        np.testing.assert_array_equal(infos["is_active"][env], one["active"])
        np.testing.assert_array_equal(infos["agent_mask"][env], one["agents"])
        np.testing.assert_array_equal(infos["action_masks"][env], one["masks"])
        assert seeds[env] == one["seed"]
    check_ends(infos, shown, mode, unpack)
    return sum("metrics" in one for one in shown)


def check_ends(infos, shown, mode, unpack):
    ended = ["metrics" in one for one in shown]
    has_final = any(ended) and mode == AutoresetMode.SAME_STEP
    names = {"is_active", "agent_mask", "action_masks"} | ({"metrics"} if any(ended) else set())
    names |= {"final_obs", "final_info", "final_state"} if has_final else set()
    assert set(infos) == names | {f"_{name}" for name in names}
    if not any(ended):
        return
    assert infos["_metrics"].tolist() == ended
    for env, one in enumerate(shown):
        for name, values in infos["metrics"].items():
            if not name.startswith("_"):
                assert values[env] == one["metrics"][name] if ended[env] else np.isnan(values[env])
        if has_final and ended[env]:
            np.testing.assert_array_equal(unpack(infos["final_obs"][env]), one["final_obs"])
            np.testing.assert_array_equal(infos["final_info"]["agent_mask"][env], one["final_agents"])
            np.testing.assert_array_equal(infos["final_info"]["is_active"][env], one["final_active"])
            np.testing.assert_array_equal(infos["final_info"]["action_masks"][env], one["final_masks"])
        elif has_final:
            assert infos["final_obs"][env] is None
    if has_final:
        assert infos["_final_obs"].tolist() == infos["_final_info"].tolist() == ended
        assert infos["final_info"]["metrics"] is infos["metrics"]


def of_env(arrays, env):
    """Returns the part of one environment in an array, or in each array of a dictionary."""
    return {name: part[env] for name, part in arrays.items()} if isinstance(arrays, dict) else arrays[env]
