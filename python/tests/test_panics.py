"""Tests that a panic in any compiled entry point reaches the caller as InternalError.

The tests force a panic in each entry. pyo3 would raise its own PanicException, which `except Exception` does not catch.
"""

import json
import re
import warnings
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from pogema_rs import AStarAgent, GridConfig, _engine, pogema_v0
from pogema_rs.errors import InternalError
from pogema_rs.planners import PlannerAgents
from pogema_rs.policies import Encoder, load, save
from pogema_rs.toolbox.evaluator import EvaluationError, evaluation
from pogema_rs.toolbox.registry import ToolboxRegistry
from pogema_rs.vec_env import Film, VecEnv

SOURCES = Path(__file__).resolve().parent.parent / "src"
GUARDED = re.compile(r"^ *(?:crate::guard::)?guarded! \{\n((?:.*\n)*?)^ *\}\n\}$", re.MULTILINE)
EMPTY = np.zeros((4, 4), np.float32)
ENVIRONMENT = {
    "name": "Environment", "size": 6, "num_agents": 2, "max_episode_steps": 4, "observation_type": "MAPF",
    "seed": {"grid_search": [1, 2]},
}  # fmt: skip

#: For each entry point, named as in the source, a call that reaches it.
CALLS = {}


def reaches(*entries):
    """Registers a function, which is called with a folder of its own, and the entries that it reaches."""

    def register(call):
        for entry in entries:
            assert entry not in CALLS, entry
            CALLS[entry] = call
        return call

    return register


def environment(**config):
    env = pogema_v0(GridConfig(size=6, num_agents=2, seed=1, on_target="restart", persistent=True, **config))
    env.reset()
    return env


@contextmanager
def ignored_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def method(name, *arguments):
    """Registers a method or an attribute of the engine of an environment."""

    def call(folder):
        engine = environment().unwrapped._engine
        engine.film(True)
        engine.reset()
        value = getattr(engine, name)
        if callable(value):
            value(*arguments)

    reaches(f"Engine::{name}")(call)


for name in ["active", "on_goal", "executed", "num_steps", "size", "is_drawn", "is_free_outside", "is_filmed"]:
    method(name)
for name in ["clear_metrics", "observe", "infos", "step_back", "goal_generators", "obstacles", "occupied"]:
    method(name)
for name in ["foretold_goals", "pools", "history", "measure", "draw_svg", "pack_film"]:
    method(name)
for name in ["cells", "starts", "goals"]:
    method(name, 1)
method("film", False)
method("draw_html", "a film")
method("reseed", {"size": 6, "num_agents": 2, "seed": 2, "density": 0.3})


@reaches("Engine::new", "Engine::reset", "Engine::step")
def play(folder):
    environment().step([0, 0])


@reaches("Engine::set_elapsed")
def set_elapsed_steps(folder):
    environment().set_elapsed_steps(1)


@reaches("Engine::set_goal_generators")
def draw_from_a_generator(folder):
    env = environment()
    env.random_generators[0].integers(5)
    env.step([0, 0])


@reaches("Engine::__reduce__", "restore_engine")
def copy_an_engine(folder):
    function, (saved,) = environment().unwrapped._engine.__reduce__()
    function(saved)


@reaches("derive_config")
def make_a_config(folder):
    GridConfig(size=6)


@reaches("did_you_mean")
def mistype_a_field(folder):
    with ignored_warnings():
        GridConfig(num_agent=2)


@reaches("AStarAgent::new", "AStarAgent::act", "AStarAgent::clear_state", "AStarAgent::__reduce__", "restore_astar")
def walk_by_astar(folder):
    agent = AStarAgent(seed=0)
    agent.act({"xy": (1, 1), "target_xy": (2, 2), "obstacles": EMPTY[:3, :3], "agents": EMPTY[:3, :3]})
    agent.clear_state()
    function, (saved,) = agent._agent.__reduce__()
    function(saved)


@reaches("make_plan", "check_plan", "cost_to_go", "Stop::new", "Stop::set", "Stop::is_set")
def plan_paths(folder):
    stop = _engine.Stop()
    places = np.array([[0, 0]])
    _engine.make_plan(EMPTY, places, places, "lacam", (1.0, None), None, 1, 0, stop)
    _engine.check_plan(EMPTY, places, places, places[None])
    _engine.cost_to_go(EMPTY, (0, 0))
    stop.set()
    assert stop.is_set


@reaches("PlanFollower::new", "PlanFollower::act", "PlanFollower::reset")
def follow_plans(folder):
    agents = PlannerAgents("lacam", seconds=1.0)
    agents.act([{"global_obstacles": EMPTY, "global_xy": (0, 0), "global_target_xy": (1, 1)}])
    agents.reset_states()


@reaches(
    "Policy::new", "Policy::encoder", "Policy::sampling", "Policy::act_batch", "Policy::act", "Policy::logits",
    "Policy::reset", "write_network",
)  # fmt: skip
def play_a_network(folder):
    rng = np.random.default_rng(0)
    tensors = {"policy.weight": rng.normal(size=(5, 9)), "policy.bias": np.zeros(5)}
    save(folder / "small.safetensors", Encoder(1, ["obstacles"]), ["flatten"], tensors)
    policy = load(folder / "small.safetensors")
    env = VecEnv({"size": 6, "num_agents": 2, "seed": 1}, 2)
    env.reset()
    policy.act(env)
    policy.reset_states()
    policy.act(environment(observation_type="MAPF").reset()[0])
    encoder, sampling = policy.encoder, policy._policy.sampling()
    policy.logits(np.zeros((1, 1, 3, 3), np.float32))
    assert encoder is not None and sampling is not None


@reaches("random_map", "maze", "warehouse", "warehouse_cells", "movingai_map")
def make_maps(folder):
    _engine.random_map((4, 4), 0.3, 1)
    _engine.maze((5, 5), 0.3, 4, 0.8, 1)
    shelves = _engine.warehouse([2, 1, 2, 2, 5, 1, 5])
    _engine.warehouse_cells(shelves, 5, 5)
    _engine.movingai_map("type octile\nheight 1\nwidth 1\nmap\n.", True)


@reaches("make_instances")
def make_instances(folder):
    _engine.make_instances({"size": 6, "num_agents": 2, "seed": 1}, None, [1], 4)


@reaches(
    "Batch::new", "Batch::film", "Batch::films", "Batch::take_film_failures", "Batch::finish_films",
    "Batch::set_configs", "Batch::reset", "Batch::step", "Batch::ended", "Batch::global_state", "Batch::mask_agents",
    "Batch::metrics", "Batch::mask_actions", "Batch::episode_seeds", "Batch::sizes", "Batch::observation_type",
    "Batch::num_threads", "Batch::close",
)  # fmt: skip
def play_a_batch(folder):
    config = {"size": 6, "num_agents": 2, "seed": 1, "max_episode_steps": 1}
    env = VecEnv([config, {**config, "num_agents": 1}], 2, film=Film(folder))
    env.reset()
    env.step(np.zeros((2, 2), int))
    env.set_configs({**config, "num_agents": 1})
    env.state()
    env.episode_seeds  # noqa: B018 - calls the engine
    env._batch.mask_actions(np.zeros((2, 2, 5), np.int8))
    env._batch.films()
    env.close()


@reaches("machine")
def describe_the_machine(folder):
    _engine.machine()


@reaches("num_cores")
def use_many_threads(folder):
    with ignored_warnings():
        VecEnv({"size": 6, "num_agents": 2}, 2, num_threads=_engine.MAX_THREADS)


class Stays:
    def act(self, observations):
        return [0] * len(observations)

    def reset_states(self):
        pass


@reaches(
    "Evaluation::new", "Evaluation::warnings", "Evaluation::check_algorithms", "Evaluation::open",
    "Evaluation::release", "Evaluation::num_episodes", "Evaluation::is_foreign", "Evaluation::has_views",
    "Evaluation::dask", "Evaluation::algorithms", "Evaluation::map", "Evaluation::begin", "Evaluation::keep",
    "Evaluation::finish", "Evaluation::picks", "Evaluation::write_report",
)  # fmt: skip
def evaluate_own_policy(folder):
    ToolboxRegistry.register_algorithm("Stays", Stays)
    suite = {"environment": {**ENVIRONMENT, "map_name": "puzzle-comb"}, "algorithms": {"A": {"name": "Stays"}}}
    evaluation(suite, str(folder / "out"), html=str(folder / "page.html"))


class Fails(Stays):
    def act(self, observations):
        raise ValueError("no action")


@reaches("Evaluation::note", "Evaluation::environment", "Evaluation::whole_environment")
def evaluate_a_failing_policy(folder):
    ToolboxRegistry.register_algorithm("Fails", Fails)
    with pytest.raises(EvaluationError, match="could not be played"):
        evaluation({"environment": ENVIRONMENT, "algorithms": {"A": {"name": "Fails"}}}, str(folder / "out"))


@reaches("Evaluation::run_built_in")
def evaluate_a_built_in_policy(folder):
    evaluation({"environment": ENVIRONMENT, "algorithms": {"A": {"name": "stay"}}}, str(folder / "out"))


@reaches("play_built_in")
def play_one_episode(folder):
    suite = {"environment": {**ENVIRONMENT, "seed": 1}, "algorithms": {"A": {"name": "stay"}}}
    _engine.play_built_in(json.dumps(suite), [])


@reaches("check_views", "show_views")
def show_results(folder):
    views = {"Table": {"type": "tabular"}}
    suite = {"environment": ENVIRONMENT, "algorithms": {"A": {"name": "stay"}}, "results_views": views}
    evaluation(suite, str(folder / "out"))
    _engine.check_views(json.dumps({"results_views": views}))
    _engine.show_views([str(folder / "out")], None, [], (None, None, None), None, None)


@reaches("force_panic")
def force(folder):
    _engine._force_panic("nothing", "unused")


def entries():
    """Returns the names of the entries in the sources."""
    found = []
    for source in SOURCES.rglob("*.rs"):
        for block in GUARDED.findall(source.read_text()):
            of_class = re.search(r"^impl (\w+) \{", block, re.MULTILINE)
            name = re.compile(rf"^{'    ' if of_class else ''}(?:pub(?:\(\w+\))? )?fn (\w+)", re.MULTILINE)
            found += [f"{of_class[1]}::{each}" if of_class else each for each in name.findall(block)]
    return sorted(found)


def test_every_entry_is_guarded():
    entry = re.compile(r"^#\[py(methods|function)\]$", re.MULTILINE)
    for source in SOURCES.rglob("*.rs"):
        assert not entry.findall(GUARDED.sub("", source.read_text())), source
    assert sorted(CALLS) == entries()


@pytest.mark.parametrize("entry", CALLS)
def test_a_panic_is_an_internal_error(entry, tmp_path):
    _engine._force_panic(entry, "two\nlines")
    with pytest.raises(InternalError, match=r"^internal error, please report it: two\\nlines$"):
        CALLS[entry](tmp_path)


@pytest.mark.parametrize("call", dict.fromkeys(CALLS.values()), ids=lambda call: call.__name__)
def test_without_a_panic_the_calls_succeed(call, tmp_path):
    call(tmp_path)
