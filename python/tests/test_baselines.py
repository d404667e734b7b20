"""Trainer tests that run without PyTorch; `./check baselines` runs the others."""

import functools
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from pogema_rs import GridConfig, VecEnv
from pogema_rs.baselines import METHODS, __main__, _config, _episodes, load_config
from pogema_rs.toolbox.generators.maze_generator import MazeGenerator, MazeRangeSettings
from pogema_rs.toolbox.generators.random_generator import MapRangeSettings, generate_map
from pogema_rs.toolbox.generators.warehouse_generator import WarehouseConfig, generate_warehouse

CONFIGS = Path(_config.__file__).parent / "configs"
ROOT = Path(__file__).resolve().parents[2]


def cells(text):
    """Returns the text of a map with `.` for every cell that is not an obstacle."""
    return re.sub(r"[^#\n]", ".", text.strip())


@functools.cache
def published_maps():
    """Returns the cells of each published map with its kind and seed."""
    maps, mazes = {}, MazeRangeSettings(17, 21, 17, 21)
    for seed in _episodes.PUBLISHED_SEEDS:
        maps[cells(generate_map(MapRangeSettings().sample(seed)))] = ("random", seed)
        maps[cells(MazeGenerator.generate_maze(**mazes.sample(seed)))] = ("mazes", seed)
    maps[cells(generate_warehouse(WarehouseConfig()))] = ("warehouse", None)
    return maps


def test_training_uses_no_published_map_and_no_published_seed():
    published = published_maps()
    suites = [yaml.safe_load(path.read_text()) for path in ROOT.glob("suites/*/*.yaml")]
    seeds = set()
    for suite in suites:
        listed = suite["environment"].get("seed", 0) if "environment" in suite else 0
        seeds.update(listed["grid_search"] if isinstance(listed, dict) else [listed])
    assert suites and seeds and max(seeds) < _episodes.FIRST_SEED
    assert max(_episodes.PUBLISHED_SEEDS) < _episodes.FIRST_SEED
    for kind in ("random", "mazes", "warehouse"):
        episodes = _episodes.Episodes(_config.EnvironmentConfig(maps=(kind,)), 0, 128)
        parts = [episodes.of_validation(64), *(episodes.of_iteration(number, 64) for number in range(20))]
        for configs, drawn in parts:
            assert min(drawn) >= _episodes.FIRST_SEED
            assert published.keys().isdisjoint(cells(config["map"]) for config in configs)
    # The comparison finds a published map.
    assert published[cells(_episodes.map_text("random", 5))] == ("random", 5)


@pytest.mark.parametrize("seed", [0, 587, 2175])
def test_a_published_maze_is_replaced(seed):
    published = published_maps()
    maze = cells(MazeGenerator.generate_maze(**MazeRangeSettings(17, 21, 17, 21).sample(seed)))
    assert published[maze][0] == "mazes"
    drawn = cells(_episodes.map_text("mazes", seed))
    assert drawn not in published and drawn != maze


def shipped_maps():
    """Yields the cells of each map of the shipped training runs."""
    longest = {}
    for path in sorted(ROOT.glob("policies/weights/*/run.json")):
        run = json.loads(path.read_text(encoding="utf-8"))
        config = _config.read_config(run["config"], run["method"], str(path))
        # Runs with equal keys draw the same maps.
        key = (run["seed"], config.schedule.lanes, config.environment.maps, tuple(config.environment.kinds))
        if run["iterations"] > longest.get(key, (0, None))[0]:
            longest[key] = (run["iterations"], config.environment)
    assert len(longest) >= 3
    for (seed, lanes, *_), (iterations, environment) in longest.items():
        episodes = _episodes.Episodes(environment, seed, 1)
        for number in range(iterations):
            yield from (cells(config["map"]) for config in episodes.of_iteration(number, lanes)[0])


@pytest.mark.slow
def test_no_map_of_the_shipped_runs_is_published():
    published, shipped = published_maps(), set(shipped_maps())
    assert shipped.isdisjoint(published)
    page = (ROOT / "docs" / "training.md").read_text(encoding="utf-8")
    assert f"None of the {len(shipped):,} maps of the shipped training runs is published." in page


def test_episodes_depend_on_seed_and_iteration_and_validation_has_its_own():
    episodes = _episodes.Episodes(_config.EnvironmentConfig(maps=("random", "mazes")), 3, 256)
    first, again = episodes.of_iteration(7, 8), episodes.of_iteration(7, 8)
    assert first == again
    drawn = [seed for number in range(50) for seed in episodes.of_iteration(number, 16)[1]]
    validation = episodes.of_validation(64)[1]
    assert len({*drawn, *validation}) == 50 * 16 + 64
    assert episodes.of_validation(2)[0][0]["max_episode_steps"] == 256
    other = _episodes.Episodes(_config.EnvironmentConfig(maps=("random", "mazes")), 4, 256)
    assert other.of_iteration(7, 8) != first


@pytest.mark.parametrize("kind", _config.MAP_KINDS)
def test_every_map_fits_the_room(kind):
    episodes = _episodes.Episodes(_config.EnvironmentConfig(maps=(kind,), num_agents=(4,)), 0, 64)
    for number in range(5):
        configs, seeds = episodes.of_iteration(number, 16)
        env = VecEnv([GridConfig(**config) for config in configs], map_size=episodes.map_size)
        env.reset(seed=seeds)
        env.close()


@pytest.mark.parametrize("method", METHODS)
def test_every_hyperparameter_has_a_source(method):
    lines = (CONFIGS / f"{method}.yaml").read_text().splitlines()
    values = [line for line in lines if re.match(r" +\w+: ", line)]
    assert len(values) > 20
    assert [line for line in values if not re.search(r"  # \S+", line)] == []
    assert load_config(method).method == method


WRONG = {
    "learner: {discuont: 0.9}": "unknown key `learner.discuont`; did you mean `learner.discount`?",
    "learnr: {}": "unknown key `learnr`; did you mean `learner`?",
    "learner: {zzz: 1}": "unknown key `learner.zzz`; did you mean `learner.",
    "learner: 3": "learner is 3, expected a mapping",
    "learner: {batch: 1.5}": "learner.batch is 1.5, expected a whole number",
    "learner: {batch: true}": "learner.batch is True, expected a whole number",
    "learner: {discount: high}": "learner.discount is 'high', expected a number",
    "learner: {discount: 1.5}": "learner.discount is 1.5, expected more than 0, at most 1",
    "learner: {temperature: -1}": "learner.temperature is -1.0, expected 0, or at least 1e-06",
    "learner: {replay: 3}": "learner.replay is 3, expected at least 32, the number of lanes",
    "environment: {maps: [cave]}": "environment.maps is ('cave',), expected names from random",
    "environment: {num_agents: 0}": "environment.num_agents is (0,), expected numbers of at least 1",
    "environment: {num_agents: [8, 1.5]}": "environment.num_agents is [8, 1.5], expected a list of whole numbers",
    "environment: {num_agents: many}": "environment.num_agents is 'many', expected a whole number",
    "environment: {maps: random}": "environment.maps is 'random', expected a list of names",
    "environment: {on_target: [stop]}": "environment.on_target is ('stop',), expected names from nothing",
    "environment: {on_target: nothing}": "environment.on_target is 'nothing', expected a list of names",
    "network: {blocks: 2}": "network.blocks is 2, expected 0 without filters",
    "schedule: {lanes: 0}": "schedule.lanes is 0, expected at least 1",
    "encoder: {radius: 5, channels: [cost_tracer]}": "encoder.channels is ('cost_tracer',), expected names from",
    "encoder: {radius: 0, channels: [goal]}": "encoder: radius is 0, expected 1 to 128",
    "encoder: {radius: 64, channels: [goal]}": "encoder.radius is 64, expected at most 63",
    "learner: {max_gradient: 0}": "learner.max_gradient is 0.0, expected more than 0",
    "learner: {discount: .nan}": "learner.discount is nan, expected a finite number",
    "environment: {maps: [random, mazes, plain]}\nschedule: {lanes: 2}": "schedule.lanes is 2, expected at least 3",
    "environment: {maps: [random, mazes]}\nschedule: {validation_episodes: 1}": "schedule.validation_episodes is 1",
    "environment: {collision_system: hard}": "environment.collision_system is 'hard', expected one of",
    "environment: {density: 7}": "environment.density is 7.0, expected at least 0",
    "environment: {size: 2024-99-99}": "month must be in 1..12",
    "imitation: {planner: none}": "imitation: `planner` is `none`, expected one of",
    "imitation: {nodes: 99999999999999999999999}": "imitation.nodes is 99999999999999999999999, expected at most",
    "learner: {batch: 8, lambda: 0.5, batch: 9}": "the key 'batch' is repeated",
    "network: {hidden: -1}": "network.hidden is -1, expected at least 0",
    "network: {hidden: 5000}": "network.hidden is 5000, expected at most 4096",
    "learner: {learning_rate: 2}": "learner.learning_rate is 2.0, expected more than 0, at most 1",
    "rewards: {goal: 1e7}": "rewards.goal is 10000000.0, expected -1,000,000 to 1,000,000",
    "environment: {num_agents: [8, 20000]}": "environment.num_agents is (8, 20000), expected numbers of at most 10000",
    "a: " + 3000 * "[": "maximum recursion depth exceeded",
    "method: vdn": "method is 'vdn', expected 'qmix'",
    "a: [": "while parsing",
    "[]": "the file holds a value of type list, expected a mapping",
}


@pytest.mark.parametrize("text", WRONG)
def test_wrong_files_are_reported_in_one_line(text, tmp_path, capsys):
    path = tmp_path / "own.yaml"
    rest = "" if text.startswith(("[", "method")) else "method: qmix\n"
    rest += "" if "encoder" in text or text.startswith("[") else "encoder: {radius: 5, channels: [goal]}\n"
    path.write_text(rest + text + "\n")
    assert __main__.main(["config", "qmix", "--config", str(path)]) == 1
    message = capsys.readouterr().err
    assert message.startswith(f"config qmix: {path}: ") and WRONG[text] in message
    assert message.count("\n") == 1


@pytest.mark.parametrize("method", ["epom", "mappo"])
def test_networks_that_need_a_dense_layer_are_rejected_without_one(method):
    with pytest.raises(ValueError, match="network.hidden is 0, expected at least 1 for mappo and for encoders"):
        load_config(method, None, ["network.hidden=0"])


def test_wrong_arguments_are_reported_in_one_line(tmp_path, capsys):
    out = ["--out", str(tmp_path / "run")]
    for arguments, expected in (
        (["train", "qmx", *out], "method is 'qmx', expected one of iql"),
        (["train", "qmix", *out, "--set", "learner.batch=1.5"], "with --set learner.batch=1.5: learner.batch is 1.5"),
        (["train", "ippo", *out, "--set", "learner.value=-1"], "learner.value is -1.0, expected at least 0"),
        (["train", "ippo", *out, "--set", "learner.entropy=-1"], "learner.entropy is -1.0, expected at least 0"),
        (["train", "qmix", *out, "--minutes", "0"], "--minutes is 0.0, expected a finite number above 0"),
        (["train", "qmix", *out, "--iterations", "-1"], "--iterations is -1, expected a finite number above 0"),
        (["train", "qmix", *out, "--seed", "-1"], "--seed is -1, expected 0 to"),
        (["train", "qmix", *out, "--set", "discount=1"], "expected SECTION.KEY=VALUE"),
        (["train", "qmix", *out, "--config", str(tmp_path / "none.yaml")], "none.yaml: No such file or directory"),
    ):
        assert __main__.main(arguments) == 1
        message = capsys.readouterr().err
        assert expected in message and message.count("\n") == 1
    assert not (tmp_path / "run").exists()


def test_an_unknown_method_lists_all_methods_once(capsys):
    assert __main__.main(["config", "zzz"]) == 1
    assert capsys.readouterr().err.count("qmix") == 1


def test_numbers_may_have_an_exponent():
    assert load_config("iql", None, ["learner.learning_rate=1e-4"]).learner.learning_rate == 1e-4


def test_missing_torch_is_one_line_that_names_the_extra(tmp_path):
    blocked = "import sys; sys.modules['torch'] = None\nfrom pogema_rs.baselines.__main__ import main\nsys.exit(main())"
    command = [sys.executable, "-c", blocked, "train", "qmix", "--out", str(tmp_path / "run")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "train qmix: training needs torch: pip install 'pogema-rs[train]'\n"
    assert not (tmp_path / "run").exists()


def test_import_needs_no_package_of_the_extra():
    program = (
        "import sys\n"
        "for name in ('torch', 'torchrl', 'tensordict', 'yaml', 'matplotlib'): sys.modules[name] = None\n"
        "import pogema_rs.baselines\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_maps_have_room_for_a_large_crowd():
    config = load_config("qmix", None, ["environment.num_agents=96"])
    # In this iteration, the first map of one lane has room for only 92 agents.
    configs, seeds = _episodes.Episodes(config.environment, 0, 16).of_iteration(14, 8)
    env = VecEnv(configs)
    env.reset(seed=seeds)
    env.close()
