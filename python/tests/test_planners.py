"""Tests of planners, of agents that follow them, and of episodes collected from them."""

import threading

import numpy as np
import pytest
from pogema_rs import GridConfig, pogema_v0
from pogema_rs.errors import InstanceError
from pogema_rs.imitation import collect, episode_seed
from pogema_rs.planners import PlannerAgents, cost_to_go, plan, validate

OBSTACLES = np.array([[0, 0, 0], [0, 1, 0], [0, 0, 0]])
STARTS, GOALS = [[0, 0], [0, 2]], [[0, 2], [0, 0]]


@pytest.mark.parametrize("planner", ["lacam", "pbs", "ecbs", "cbs"])
def test_plan_is_found_and_valid(planner):
    found = plan(OBSTACLES, STARTS, GOALS, planner, nodes=2000)
    assert found.is_solved
    assert found.cells.shape == (found.makespan + 1, 2, 2) and found.cells.dtype == np.int32
    assert found.actions.shape == (found.makespan, 2) and found.actions.dtype == np.int64
    assert found.lower_bound <= found.sum_of_costs <= 12
    assert validate(OBSTACLES, STARTS, GOALS, found.cells) is None
    moves = np.array([[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]])
    assert np.array_equal(np.diff(found.cells, axis=0), moves[found.actions])


def test_pibt_reports_whether_it_solved_the_problem():
    assert plan(OBSTACLES, STARTS[:1], GOALS[:1], "pibt").sum_of_costs == 2
    found = plan(OBSTACLES, STARTS, GOALS, "pibt", nodes=50)
    assert found.is_solved == (found.cells[-1].tolist() == GOALS)
    assert validate(OBSTACLES, STARTS, None, found.cells) is None


def test_cbs_finds_the_optimal_cost():
    assert plan(OBSTACLES, STARTS, GOALS, "cbs").sum_of_costs == 8


def test_same_node_budget_gives_the_same_plan():
    rng = np.random.default_rng(0)
    free = np.argwhere(rng.random((16, 16)) >= 0.2)
    obstacles = np.ones((16, 16), dtype=bool)
    obstacles[tuple(free.T)] = False
    picks = rng.permutation(len(free))
    problem = (obstacles, free[picks[:12]], free[picks[-12:]])
    first, second = (plan(*problem, nodes=500, seed=3) for _ in range(2))
    assert first.is_solved and second.is_solved
    assert first.reason == second.reason
    assert np.array_equal(first.cells, second.cells)


def test_impossible_problems_and_timeouts_are_outcomes():
    corridor = [[0, 0, 0]]
    found = plan(corridor, [[0, 0], [0, 2]], [[0, 2], [0, 0]])
    assert found.outcome == "impossible" and found.reason
    assert found.cells is None
    assert "have the same goal" in plan(corridor, [[0, 0], [0, 1]], [[0, 2], [0, 2]]).reason
    assert plan(corridor, [[0, 0]], [[0, 2]], max_steps=1).outcome == "impossible"
    late = plan(OBSTACLES, STARTS, GOALS, nodes=0)
    assert (late.outcome, late.lower_bound) == ("timed_out", 4)
    assert plan(OBSTACLES, np.empty((0, 2)), np.empty((0, 2))).is_solved


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"planner": "none"}, "`planner` is `none`, expected one of `lacam`, `pibt`, `pbs`, `ecbs`, `cbs`"),
        ({"goals": [[1, 1], [0, 0]]}, "agent 0: goal .* is not a free cell"),
        ({"goals": [[0, 2]]}, "goals has length 1, expected 2"),
        ({"goals": [[0, -1], [0, 0]]}, "agent 0: .* is not on the map"),
        ({"seconds": float("nan")}, "^`seconds` is `NaN`, expected 0 to 1e19 seconds$"),
        ({"seconds": float("inf")}, "^`seconds` is `inf`, expected 0 to 1e19 seconds$"),
        ({"obstacles": np.empty((0, 3))}, "the map has no cells"),
        ({"goals": [[0, 2, 1], [0, 0, 1]]}, "^`goals` is `an array of 3 columns`"),
        ({"goals": [[0.9, 2], [0, 0]]}, "goals holds a value that is not a whole number, expected whole numbers"),
        (
            {"starts": [[0, 0], [0, float("nan")]]},
            "starts holds a value that is not a whole number, expected whole numbers",
        ),
        ({"starts": [0, 0]}, "starts has 1 axis, expected 2"),
        (
            {"goals": [[True, False], [False, False]]},
            "goals holds a value that is not a whole number, expected whole numbers",
        ),
        ({"goals": [["a", "b"], ["c", "d"]]}, "goals holds a value that is not a whole number, expected whole numbers"),
        ({"num_threads": -1}, "num_threads is -1, expected 1 to"),
        ({"seed": -1}, "seed is -1, expected 0 to 18446744073709551615"),
        ({"nodes": -1}, "nodes is -1, expected at least 0"),
        ({"max_steps": -1}, "max_steps is -1, expected at least 0"),
    ],
)
def test_wrong_input_raises_a_one_line_error(arguments, text):
    with pytest.raises(ValueError, match=text) as raised:
        plan(**{"obstacles": OBSTACLES, "starts": STARTS, "goals": GOALS, **arguments})
    assert "\n" not in str(raised.value)
    if "planner" not in arguments and isinstance(next(iter(arguments.values())), int):
        with pytest.raises(ValueError, match=text):
            PlannerAgents(**arguments)


def test_conflicts_are_reported():
    cells = [STARTS, [[0, 1], [0, 1]]]
    assert validate(OBSTACLES, STARTS, GOALS, cells) == "step 1: agents 0 and 1 are both at (0, 1)"
    assert validate(OBSTACLES, STARTS, None, [STARTS]) is None
    with pytest.raises(ValueError, match="expected an array of shape"):
        validate(OBSTACLES, STARTS, None, [[[0], [1]]])


def test_cost_to_go_counts_moves_and_is_negative_where_no_path_leads():
    costs = cost_to_go([[0, 0, 1], [1, 0, 1], [0, 1, 0]], (0, 0))
    assert costs.dtype == np.int32
    assert costs.tolist() == [[0, 1, -1], [-1, 2, -1], [-1, -1, -1]]
    for goal, text in (
        ((1, 1), "free cell"),
        ((0, 0, 0), "goal holds 3 numbers, expected a row and a column"),
        ("ab", "goal has 0 axes, expected 1"),
        (3, "goal has 0 axes, expected 1"),
    ):
        with pytest.raises(ValueError, match=text):
            cost_to_go(OBSTACLES, goal)


def test_python_threads_run_during_planning():
    began, done = threading.Event(), []

    def run_planner():
        began.set()
        # Far too many agents for the room, so that the search uses all its time.
        cells = [[row, col] for row in range(5) for col in range(5)]
        done.append(plan(np.zeros((5, 5)), cells[:24], cells[:24][::-1], "cbs", seconds=1.0))

    thread = threading.Thread(target=run_planner)
    thread.start()
    began.wait()
    count = 0
    while thread.is_alive():
        count += 1
    assert count > 1000
    assert done[0].outcome == "timed_out"


@pytest.mark.parametrize("on_target", ["nothing", "finish"])
def test_agents_follow_a_plan_to_their_goals(on_target):
    config = GridConfig(
        num_agents=8,
        size=12,
        seed=2,
        density=0.2,
        on_target=on_target,
        observation_type="MAPF",
        collision_system="soft",
    )
    env, agents = pogema_v0(config), PlannerAgents(nodes=2000, max_steps=config.max_episode_steps)
    for _ in range(2):
        agents.reset_states()
        observations, _ = env.reset()
        terminated = truncated = [False]
        while not (all(terminated) or all(truncated)):
            observations, _, terminated, truncated, infos = env.step(agents.act(observations))
        assert infos[0]["metrics"]["CSR"] == 1.0


@pytest.mark.parametrize("planner", ["rhcr", "pibt", "guided-pibt"])
def test_lifelong_agents_reach_many_goals(planner):
    config = GridConfig(
        num_agents=8, size=12, seed=2, on_target="restart", observation_type="MAPF", collision_system="soft"
    )
    env, agents = pogema_v0(config), PlannerAgents(planner, nodes=200, lifelong=True)
    throughputs = []
    for _ in range(2):
        agents.reset_states()
        observations, _ = env.reset()
        truncated = [False]
        while not all(truncated):
            observations, _, _, truncated, infos = env.step(agents.act(observations))
        throughputs.append(infos[0]["metrics"]["avg_throughput"])
    assert throughputs[0] == throughputs[1] > 0.5
    with pytest.raises(ValueError, match="expected one of `rhcr`, `pibt`, `guided-pibt`"):
        PlannerAgents("cbs", lifelong=True)


def test_agents_need_mapf_observations():
    env = pogema_v0(GridConfig(num_agents=2, seed=1))
    with pytest.raises(TypeError, match="observation_type='MAPF'"):
        PlannerAgents().act(env.reset()[0])


def test_repeated_call_after_an_interrupt_writes_only_missing_files(tmp_path):
    config = GridConfig(num_agents=4, size=8, density=0.2, on_target="nothing", collision_system="soft")
    arguments = {"num_episodes": 5, "episodes_per_file": 2, "nodes": 200, "seed": 7}
    paths = list(collect(config, tmp_path / "data", **arguments))
    assert [path.name for path in paths] == [f"episodes-00000{number}.npz" for number in range(3)]
    whole = [path.read_bytes() for path in paths]
    paths[1].unlink()
    stamps = [path.stat().st_mtime_ns for path in (paths[0], paths[2])]
    assert list(collect(config, tmp_path / "data", **arguments)) == paths
    assert [path.stat().st_mtime_ns for path in (paths[0], paths[2])] == stamps
    assert np.array_equal(np.load(paths[1])["actions"], np.load(_written(tmp_path, whole[1]))["actions"])
    data = np.load(paths[1])
    num_steps = len(data["episode"])
    assert data["observations"].shape == (num_steps, 4, 3, 11, 11) and data["observations"].dtype == np.uint8
    assert data["actions"].shape == data["is_active"].shape == (num_steps, 4)
    assert set(data["episode"]) <= {2, 3}
    first = int(data["episode"][0])
    env = pogema_v0(config.model_copy(update={"seed": episode_seed(7, first)}), semantics="2.0")
    observations, _ = env.reset()
    for seen, actions in zip(data["observations"][data["episode"] == first], data["actions"]):
        assert np.array_equal(seen, np.stack(observations))
        observations, _, terminated, _, infos = env.step(actions.tolist())
    assert all(terminated)
    assert infos[0]["metrics"]["CSR"] == 1.0


def _written(folder, contents):
    path = folder / "kept.npz"
    path.write_bytes(contents)
    return path


SOFT = {"num_agents": 4, "size": 8, "density": 0.2, "on_target": "nothing", "collision_system": "soft"}


@pytest.mark.parametrize(
    ("fields", "arguments", "error", "text"),
    [
        ({}, {"num_workers": 0}, ValueError, "num_workers is 0, expected at least 1"),
        ({}, {"episodes_per_file": 2.5}, TypeError, "episodes_per_file is 2.5, expected a whole number"),
        ({"collision_system": "priority"}, {}, ValueError, "collision_system is 'priority', expected 'soft'"),
        ({"on_target": "restart"}, {}, ValueError, "on_target is 'restart', expected 'finish' or 'nothing'"),
    ],
)
def test_wrong_collections_are_rejected_before_they_begin(fields, arguments, error, text, tmp_path):
    with pytest.raises(error, match=text):
        collect({**SOFT, **fields}, tmp_path / "data", 1, **arguments)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("on_target", ["nothing", "finish"])
def test_collected_actions_lead_to_the_next_observations_and_to_the_goals(on_target, tmp_path):
    config = {**SOFT, "on_target": on_target, "num_agents": 8, "integration": "PyMARL"}
    (path,) = collect(config, tmp_path, 4, nodes=2000, seed=3)
    data, seeds = np.load(path), []
    for number in np.unique(data["episode"]):
        (steps,) = np.nonzero(data["episode"] == number)
        env = pogema_v0(
            GridConfig(**{**config, "integration": None, "seed": episode_seed(3, int(number))}), semantics="2.0"
        )
        observations, _ = env.reset()
        for step in steps:
            assert np.array_equal(data["observations"][step], np.stack(observations))
            observations, _, _, _, infos = env.step(data["actions"][step].tolist())
        assert infos[0]["metrics"]["CSR"] == 1.0
        seeds.append(env.grid_config.seed)
    assert seeds and seeds == data["seeds"].tolist()


def test_collection_continues_its_last_file_and_no_file_of_another_call(tmp_path):
    arguments = {"episodes_per_file": 4, "nodes": 200}
    assert len(list(collect(SOFT, tmp_path, 2, **arguments))) == 1
    paths = list(collect(SOFT, tmp_path, 8, **arguments))
    assert [set(np.load(path)["episode"]) for path in paths] == [{0, 1, 2, 3}, {4, 5, 6, 7}]
    before = [path.read_bytes() for path in paths]
    assert list(collect(SOFT, tmp_path, 6, **arguments)) == paths
    for changes in ({"seed": 1}, {"nodes": 201}, {"episodes_per_file": 3}, {"semantics": "1.4.0"}):
        with pytest.raises(ValueError, match="episodes-000000.npz: the file belongs to another call"):
            list(collect(SOFT, tmp_path, 8, **{**arguments, **changes}))
    with pytest.raises(ValueError, match="the file belongs to another call"):
        list(collect({**SOFT, "size": 9}, tmp_path, 8, **arguments))
    assert [path.read_bytes() for path in paths] == before


def test_collection_leaves_out_episodes_without_an_instance_or_a_plan(tmp_path):
    crowded = {**SOFT, "num_agents": 6, "size": 4, "density": 0.5}
    (path,) = collect(crowded, tmp_path / "crowded", 32, nodes=0)
    data = np.load(path)
    shapes = {"observations": (0, 6, 3, 11, 11), "actions": (0, 6), "is_active": (0, 6), "episode": (0,), "seeds": (0,)}
    types = {"observations": "uint8", "actions": "int8", "is_active": "bool", "episode": "int64", "seeds": "int64"}
    assert {name: data[name].shape for name in shapes} == shapes
    assert {name: str(data[name].dtype) for name in types} == types
    with pytest.raises(InstanceError):
        list(collect({**crowded, "num_agents": 16}, tmp_path / "full", 2, nodes=0))
    assert not list((tmp_path / "full").iterdir())
