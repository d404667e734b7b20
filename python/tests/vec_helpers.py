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


class Plain:
    """An environment that is reset by hand."""

    def __init__(self, config, env, seed_of, exact=False):
        self.config, self.env, self.seed_of, self.exact = config, env, seed_of, exact
        self.episode = -1
        self.begin()

    def begin(self):
        self.episode += 1
        self.seed = self.seed_of(self.env, self.episode)
        self.engine = _engine.Engine({**self.config, "seed": self.seed}, None, self.exact)
        self.engine.reset()
        self.last = None

    def observe(self):
        return np.array(self.engine.observe())

    def masks(self):
        """Returns the action masks, computed cell by cell."""
        walls, masks = self.engine.obstacles(), []
        cells = self.engine.cells(self.config["obs_radius"])
        for (row, col), is_active in zip(cells, self.engine.active):
            around = [(row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)]
            masks.append([1] + [int(is_active and not walls[place]) for place in around])
        return np.array(masks, dtype=np.int8)

    def step(self, mode, actions):
        """Plays one step and returns what `VecEnv` must return, as a dict."""
        num_agents = self.config["num_agents"]
        rewards, terminated, truncated = np.zeros(num_agents), np.zeros(num_agents, bool), np.zeros(num_agents, bool)
        shown = {}
        if self.last is None:
            _, rewards, terminated, truncated, infos = self.engine.step(actions.tolist())
            if all(terminated) or all(truncated):
                self.last = (terminated, truncated)
                shown["metrics"] = infos[0]["metrics"]
                if mode == AutoresetMode.SAME_STEP:
                    shown.update(final_obs=self.observe(), final_active=self.engine.active, final_masks=self.masks())
                    self.begin()
        elif mode == AutoresetMode.NEXT_STEP:
            self.begin()
        else:
            terminated, truncated = self.last
        shown.update(rewards=rewards, terminated=terminated, truncated=truncated, active=self.engine.active)
        return {**shown, "obs": self.observe(), "masks": self.masks(), "seed": self.seed}


def check_step(got, plain, mode, actions, seeds):
    """Compares a step of a `VecEnv` with masks to the same step of engines; returns the number of ended episodes."""
    obs, rewards, terminated, truncated, infos = got
    shown = [one.step(mode, actions[env]) for env, one in enumerate(plain)]
    for env, one in enumerate(shown):
        np.testing.assert_array_equal(obs[env], one["obs"])
        np.testing.assert_array_equal(rewards[env], np.array(one["rewards"], np.float32))
        np.testing.assert_array_equal(terminated[env], one["terminated"])
        np.testing.assert_array_equal(truncated[env], one["truncated"])
        np.testing.assert_array_equal(infos["is_active"][env], one["active"])
        np.testing.assert_array_equal(infos["action_masks"][env], one["masks"])
        assert seeds[env] == one["seed"]
    check_ends(infos, shown, mode)
    return sum("metrics" in one for one in shown)


def check_ends(infos, shown, mode):
    ended = ["metrics" in one for one in shown]
    has_final = any(ended) and mode == AutoresetMode.SAME_STEP
    names = {"is_active", "action_masks"} | ({"metrics"} if any(ended) else set())
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
            np.testing.assert_array_equal(infos["final_obs"][env], one["final_obs"])
            np.testing.assert_array_equal(infos["final_info"]["is_active"][env], one["final_active"])
            np.testing.assert_array_equal(infos["final_info"]["action_masks"][env], one["final_masks"])
        elif has_final:
            assert infos["final_obs"][env] is None
    if has_final:
        assert infos["_final_obs"].tolist() == infos["_final_info"].tolist() == ended
        assert infos["final_info"]["metrics"] is infos["metrics"]
