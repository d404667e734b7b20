"""Tests the adapters, with the frameworks' own checkers where available, and which modules an import loads."""

import subprocess
import sys

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test, parallel_seed_test
from pogema_rs import GridConfig, pogema_v0

MODES = ["finish", "nothing", "restart"]


def parallel(on_target, **fields):
    config = {"num_agents": 6, "density": 0.1, "max_episode_steps": 30, "integration": "PettingZoo", **fields}
    return pogema_v0(GridConfig(on_target=on_target, **config), semantics="2.0")


@pytest.mark.parametrize("on_target", MODES)
def test_checkers_of_pettingzoo_pass(on_target):
    env = parallel(on_target)
    assert isinstance(env, pettingzoo.ParallelEnv)
    parallel_api_test(env, num_cycles=200)
    parallel_seed_test(lambda: parallel(on_target))


def test_unknown_agents_have_no_spaces():
    env = parallel("finish")
    for space in (env.observation_space, env.action_space):
        with pytest.raises(AssertionError, match="^agent is 'foo', expected a name from 'player_0' to 'player_5'$"):
            space("foo")


def test_the_adapter_needs_no_pettingzoo():
    code = """
import sys
sys.modules["pettingzoo"] = None
from pogema_rs import GridConfig, pogema_v0
env = pogema_v0(GridConfig(num_agents=2, integration="PettingZoo", seed=1))
observations, _ = env.reset()
print(type(env).__mro__[1:], sorted(env.step({"player_0": 1})[0]))
"""
    said = subprocess.check_output([sys.executable, "-c", code], text=True).strip()
    assert said == "(<class 'object'>,) ['player_0', 'player_1']"


def test_finished_agents_are_removed_in_pettingzoo():
    env = parallel("finish", map="aA..\nb..B", num_agents=2)
    env.reset()
    observations, rewards, terminated, _, infos = env.step({"player_0": 4, "player_1": 4, "unknown": 9})
    assert set(observations) == set(infos) == {"player_0", "player_1"}
    assert (rewards["player_0"], terminated["player_0"]) == (1.0, True)
    assert env.agents == ["player_1"]
    assert set(env.step({})[0]) == {"player_1"}
    assert env.pogema.get_agents_xy(ignore_borders=True)[1] == [1, 1]


def test_pettingzoo_supports_mapf_observations():
    env = parallel("finish", observation_type="MAPF")
    observations, _ = env.reset()
    assert "global_obstacles" in observations["player_5"]


@pytest.mark.parametrize("num_agents", [1, 5])
def test_checker_of_gymnasium_passes(num_agents):
    env = pogema_v0(GridConfig(num_agents=num_agents, integration="gymnasium"), semantics="2.0")
    check_env(env, skip_render_check=True)


@pytest.mark.parametrize("name", ["Pogema-v0", "pogema_rs/Pogema-v0"])
def test_gymnasium_makes_environments_by_name(name):
    env = gymnasium.make(name, grid_config=GridConfig(size=8, seed=1))
    observation, info = env.reset()
    assert env.observation_space.contains(observation)
    assert info == {"is_active": True}
    assert len(env.step(0)) == 5


def test_sample_factory_resets_at_the_end_and_gets_the_metrics():
    env = pogema_v0(GridConfig(num_agents=3, seed=1, max_episode_steps=4, integration="SampleFactory"))
    first, _ = env.reset()
    assert (env.num_agents, env.is_multiagent) == (3, True)
    for _ in range(4):
        observations, _, _, truncated, infos = env.step([0, 0, 0])
    assert all(truncated)
    assert infos[0]["episode_extra_stats"] == infos[0]["metrics"]
    assert infos[0]["episode_extra_stats"] is not infos[0]["metrics"]
    assert all(np.array_equal(one, other) for one, other in zip(observations, first))
    kept = pogema_v0({"integration": "SampleFactory", "auto_reset": False, "max_episode_steps": 2})
    kept.reset()
    assert [kept.step([0])[3] for _ in range(3)] == [[False], [True], [True]]


def test_pymarl_gets_one_reward_and_the_metrics_at_the_end():
    env = pogema_v0(GridConfig(num_agents=3, seed=1, max_episode_steps=5, integration="PyMARL"))
    info = env.get_env_info()
    assert info == {"state_shape": 336, "obs_shape": 363, "n_actions": 5, "n_agents": 3, "episode_limit": 5}
    assert env.reset().shape == (3 * 363,)
    assert env.get_obs().shape == (3, 363)
    assert env.get_avail_actions() == [[0, 1, 2, 3, 4]] * 3
    for _ in range(5):
        reward, done, metrics = env.step(env.sample_actions())
    assert done
    assert set(metrics) == {"ISR", "CSR", "ep_length"}
    assert isinstance(reward, float)
    env = pogema_v0(GridConfig(seed=1, max_episode_steps=1, integration="PyMARL", persistent=True))
    env.reset()
    assert env.step([0])[1:] == (True, {})


def test_state_of_pymarl_is_the_global_state():
    config = GridConfig(num_agents=3, size=9, seed=1, on_target="restart", integration="PyMARL")
    env = pogema_v0(config)
    env.reset()
    seen = set()
    for _ in range(30):
        state = env.get_state()
        assert state.shape == (env.get_state_size(),) == (env.get_env_info()["state_shape"],)
        cells = [*env.env.get_agents_xy(ignore_borders=True), *env.env.get_targets_xy(ignore_borders=True)]
        assert np.array_equal(state[:12], np.array(cells).flatten() / 8)
        assert np.array_equal(state[12:], env.env.get_obstacles().flatten())
        seen.add(state.tobytes())
        env.step([int(action) for action in env.sample_actions()])
    assert len(seen) > 10


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({"auto_reset": True}, KeyError),
        ({"auto_reset": True, "integration": "PettingZoo"}, KeyError),
        ({"integration": "rllib"}, NotImplementedError),
    ],
)
def test_unsupported_integrations_are_rejected(fields, error):
    with pytest.raises(error, match="expected"):
        pogema_v0(GridConfig(**fields))


def test_importing_the_package_does_not_import_pydantic():
    code = "import sys, pogema_rs; print([name for name in ('gymnasium', 'pydantic') if name in sys.modules])"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "['gymnasium']"


def test_names_of_the_package_import_no_framework():
    code = (
        "import sys; from pogema_rs import *; "
        "print([name for name in ('pettingzoo', 'torch', 'ray', 'pufferlib', 'sample_factory', 'matplotlib') "
        "if name in sys.modules])"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"


def test_interleaved_imports_of_pogema_load_their_own_modules():
    code = """
import sys
import pogema_rs
from pogema_rs.install import _Alias
pogema_rs.install_as_pogema()
alias = next(finder for finder in sys.meta_path if isinstance(finder, _Alias))
specs = [alias.find_spec(f"pogema.{name}") for name in ("grid", "envs")]
modules = [alias.create_module(spec) for spec in specs]
for spec, module in zip(specs, modules):
    module.__spec__ = spec
    alias.exec_module(module)
assert [module.__spec__.name for module in modules] == ["pogema_rs.grid", "pogema_rs.envs"]
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_install_as_pogema_redirects_imports_of_pogema():
    code = """
import gymnasium, pogema_rs
pogema_rs.install_as_pogema()
pogema_rs.install_as_pogema()
import pogema
from pogema import AnimationMonitor, GridConfig, pogema_v0
from pogema.a_star_policy import AStarAgent
from pogema.envs import ActionsSampler, PogemaBase
from pogema.grid import Grid
from pogema.grid_config import GridConfig as Same
from pogema.grid_registry import RegisteredGrid
from pogema.integrations.make_pogema import make_single_agent_gym
from pogema.integrations.pettingzoo import parallel_env
from pogema.integrations.pymarl import PyMarlPogema
from pogema.integrations.sample_factory import AutoResetWrapper
from pogema.svg_animation.animation_drawer import AnimationConfig
from pogema.svg_animation.animation_wrapper import AnimationMonitor as Monitor
from pogema.utils import render_grid
from pogema.wrappers.metrics import RuntimeMetricWrapper
assert GridConfig is Same is pogema_rs.GridConfig and Monitor is AnimationMonitor
assert GridConfig.__module__ == "pogema_rs.grid_config"
RegisteredGrid("hall", "....\\n....")
class Mine(gymnasium.Wrapper):
    def reset(self, **kwargs):
        assert self.get_num_agents() == 2
        return self.env.reset(**kwargs)
env = Mine(pogema_v0(GridConfig(num_agents=2, map_name="hall")))
env.reset()
assert env.get_obstacles(ignore_borders=True).shape == (2, 4)
try:
    import pogema.nothing
except ModuleNotFoundError:
    print("done")
"""
    assert subprocess.check_output([sys.executable, "-W", "ignore", "-c", code], text=True) == "done\n"
