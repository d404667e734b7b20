"""Uses the functions of pogema-toolbox, and prints what they return as JSON.

`run_as.py` runs this script with pogema-toolbox and with pogema_rs.
"""

import io
import json
import os
import zipfile
from pathlib import Path

import numpy as np
from pogema_toolbox import eval_utils, evaluator, moving_ai_ingestion
from pogema_toolbox.algorithm_config import AlgoBase
from pogema_toolbox.config_variant_generator import generate_variants
from pogema_toolbox.create_env import Environment, create_env_base
from pogema_toolbox.generators import maze_generator, random_generator, warehouse_generator
from pogema_toolbox.registry import ToolboxRegistry
from pogema_toolbox.results_holder import ResultsHolder
from pogema_toolbox.views import view_multi_plot, view_plot, view_tabular, view_utils

SCENARIOS = {}


def scenario(function):
    """Adds a function to the scenarios."""
    SCENARIOS[function.__name__] = function
    return function


def raises(kind, call, *arguments, **keywords):
    """Returns whether a call raises an error of a class."""
    try:
        call(*arguments, **keywords)
    except kind:
        return True
    return False


def numbers(low, high, count):
    """Returns drawn seeds."""
    return np.random.default_rng(7).integers(low, high, count).tolist()


def frame(table):
    """Returns the columns, the index and the cells of a frame."""
    return [list(table.columns), list(table.index), table.values.tolist()]


def rows():
    """Returns results of two algorithms on the same 12 instances, with a list among the metrics."""
    generator = np.random.default_rng(3)
    made = []
    for algorithm in ("B", "A"):
        for seed in range(6):
            for agents in (8, 4):
                metrics = {"CSR": float(seed % 2), "makespan": int(generator.integers(40)), "steps": [1, 2]}
                fields = {"num_agents": agents, "seed": seed, "map_name": f"m{seed % 3}"}
                made.append({"metrics": metrics, "env_grid_search": fields, "algorithm": algorithm})
    return made


@scenario
def mazes():
    """Settings and maps of drawn seeds."""
    settings = [maze_generator.MazeRangeSettings().sample(seed) for seed in numbers(0, 2**32, 60)]
    wide = maze_generator.MazeRangeSettings(width_min=9, width_max=30, go_straight_min=0.2, wall_components_max=20)
    settings += [wide.sample(seed) for seed in numbers(0, 2**20, 40)]
    fixed = {"width": 8, "height": 5, "obstacle_density": 0.4, "go_straight": 0.5, "seed": 3}
    for components in (0, 1, 4):
        settings.append({**fixed, "wall_components": components})
    make = maze_generator.MazeGenerator
    mazes = [make.generate_maze(**one) for one in settings]
    array = make.string_to_array(mazes[0])
    back = [make.array_to_string(array), str(array.dtype), array.tolist()]
    rejected = raises(AssertionError, make.generate_maze, 0, 5, 0.1, 1, 0.8)
    return [settings, mazes, back, rejected, make.generate_maze(4, 6, 0.3, 2, 0.8, 5)]


@scenario
def random_maps():
    """Settings and maps of drawn seeds."""
    settings = [random_generator.MapRangeSettings().sample(seed) for seed in numbers(0, 2**32, 60)]
    full = {"width": 3, "height": 4, "obstacle_density": 1.0, "seed": 1}
    return [settings, [random_generator.generate_map(one) for one in [*settings, full]]]


@scenario
def warehouses():
    """Maps of drawn sizes."""
    seen = [warehouse_generator.generate_wfi_warehouse()]
    for seed in range(80):
        names = list(vars(warehouse_generator.WarehouseConfig()))
        drawn = dict(zip(names, np.random.default_rng(seed).integers(1, 6, len(names)).tolist()))
        config = warehouse_generator.WarehouseConfig(**drawn)
        seen.append([drawn, warehouse_generator.generate_warehouse(config)])
        if config.vertical_gap == 1:
            seen.append(raises(ValueError, warehouse_generator.generate_wfi_warehouse, config))
        else:
            seen.append(warehouse_generator.generate_wfi_warehouse(config))
    text = warehouse_generator.generate_warehouse(warehouse_generator.WarehouseConfig())
    return [*seen, warehouse_generator.generate_wfi_positions(text, 5, 3)]


@scenario
def files_of_maps():
    """The bytes of map sets."""
    maze_generator.generate_and_save_mazes("mazes", range(8, 12))
    random_generator.generate_and_save_maps("random", range(98, 102))
    maze_generator.maps_dict_to_yaml("some.yaml", {"b: c": "..\n.#", "a": ".", "empty": "", "end": "..\n"})
    return [Path(name).read_text() for name in ("mazes.yaml", "random.yaml", "some.yaml")]


@scenario
def variants():
    """All combinations, at any depth."""
    specs = [
        {"name": "Environment", "seed": {"grid_search": [0, 1, 2]}, "size": 8},
        {"seed": 1},
        {},
        {"b": {"grid_search": [[1], [2, 3]]}, "a": {"x": {"grid_search": ["u", "v"]}, "y": {"grid_search": [None]}}},
        {"a": {"b": {"c": {"grid_search": [1, 2]}, "d": 3}}},
        {"a": {"grid_search": []}, "b": 1},
        {"a": {"grid_search": [{"c": 1}, {"c": 2}]}, "d": [{"grid_search": [1]}]},
        {"a": {"grid_search": (1, 2)}, "b": {"grid_search": range(2)}},
    ]
    return [[[sorted(map(str, changes.items())), variant] for changes, variant in generate_variants(s)] for s in specs]


@scenario
def moving_ai():
    """Maps in an archive."""
    text = "type octile\nheight 4\nwidth 5\nmap\n@@@@@\n@.TO@\n@GSW@\n@@@@@\n"
    with zipfile.ZipFile("maps.zip", "w") as archive:
        archive.writestr("town.map", text)
        archive.writestr("deep/other.map", text.replace("\n", "\r\n").replace("@@@@@\r\n@.", "@@@@@\r\n.."))
        archive.writestr("readme.txt", "no map")
    whole = moving_ai_ingestion.map_to_grid(io.BytesIO(text.encode()), remove_border=False)
    return [moving_ai_ingestion.download_moving_ai_maps(Path("maps.zip").resolve().as_uri()), whole]


@scenario
def tables():
    """Frames, means and intervals; the samples come from NumPy's global generator."""
    results = rows()
    gap = [*results, {"metrics": {"CSR": 1.0}, "env_grid_search": {"num_agents": 4, "seed": 9}, "algorithm": "A"}]
    whole, with_gap = (view_utils.eval_logs_to_pandas(one) for one in (results, gap))
    seen = [frame(whole), frame(view_utils.drop_na(with_gap))]
    views = [
        {},
        {"drop_keys": ["seed", "map_name"], "round_digits": 3, "sort_by": "num_agents"},
        {"drop_keys": ["seed"], "rename_fields": {"CSR": "Share"}, "sort_by": ["num_agents", "algorithm"]},
        {"drop_keys": ["seed", "map_name", "num_agents"]},
    ]
    for fields in views:
        np.random.seed(1)
        seen.append(frame(view_tabular.preprocess_table(results, view_tabular.TabularView(**fields))))
    column = view_utils.eval_logs_to_pandas(results)["makespan"]
    for settings in ({}, {"error_method": "sd"}, {"error_method": None}, {"estimator": np.median, "error_level": 90}):
        np.random.seed(2)
        aggregator = view_tabular.Aggregator(**settings)
        seen += [aggregator(column), aggregator(column[:1])]
    seen.append(raises(KeyError, view_tabular.Aggregator(error_method="x"), column))
    np.random.seed(3)
    return [*seen, view_tabular.Aggregator.bootstrap(column, n_boot=5).tolist()]


@scenario
def logged_tables():
    """A table as text in the log."""
    np.random.seed(4)
    for table_format in ("psql", "latex"):
        view = view_tabular.TabularView(print_results=True, table_format=table_format, drop_keys=["seed", "map_name"])
        view_tabular.process_table_view(rows(), view)
    text = Path("log.txt").read_text().replace("\x1b[0m", "")
    return [line for line in text.splitlines() if line[:1] in "+|" or "&" in line]


@scenario
def plots():
    """The fields of views, and which files are written."""
    ticks = {"x": "num_agents", "y": "makespan", "ticks": [4, 8], "hue_order": ["B", "A"], "unknown": 1}
    plot, multi = view_plot.PlotView(**ticks), view_multi_plot.MultiPlotView(over="map_name", **ticks)
    for ending in ("pdf", "svg", "png"):
        view_plot.process_plot_view(rows(), plot, f"plot.{ending}")
    view_plot.process_plot_view(rows(), view_plot.PlotView(x="num_agents", y="nothing"), "none.pdf")
    view_plot.process_plot_view(rows(), plot)
    view_multi_plot.process_multi_plot_view(rows(), multi, "multi.pdf")
    fields = [{name: value for name, value in view.dict().items() if name != "palette"} for view in (plot, multi)]
    names = ("plot.pdf", "plot.svg", "plot.png", "multi.pdf", "none.pdf")
    written = [name for name in names if Path(name).exists()]
    return [
        fields,
        view_plot.prepare_plot_fields(plot),
        written,
        raises(ValueError, view_plot.PlotView, legend_loc="nowhere"),
    ]


@scenario
def folders():
    """Results beside the suite in one folder."""
    folder = Path("01-set")
    folder.mkdir()
    # Scripts catch the `AssertionError`.
    missing = raises(AssertionError, view_utils.load_from_folder, folder)
    (folder / "01-set.yaml").write_text("results_views: {Plot: {type: plot, x: num_agents, y: CSR}}\n")
    (folder / "A.json").write_text(json.dumps(rows()))
    results, config = view_utils.load_from_folder(folder)
    evaluator.run_views(results, config, eval_dir=folder)
    evaluator.run_views(results, {}, eval_dir=folder)
    return [missing, results, config, sorted(path.name for path in folder.iterdir())]


@scenario
def uploads():
    """The calls to wandb."""
    folder = Path("02-set")
    folder.mkdir()
    (folder / "A.json").write_text("[]")
    for disabled in (True, False):
        eval_utils.initialize_wandb({"seed": 1}, folder, disabled, "Benchmark")
        eval_utils.save_evaluation_results(folder)
    eval_utils.create_and_push_summary_archive(["02-set"], Path("."), "Benchmark")
    archives = [sorted(zipfile.ZipFile(name).namelist()) for name in ("02-set.zip", "eval_summary.zip")]
    return [Path(os.environ["CALLS_OF_WANDB"]).read_text(), archives]


@scenario
def shares_of_processes():
    """Chunks, buckets, and joined rows."""
    sizes = [(size, chunks) for size in range(0, 30, 3) for chunks in range(1, 9)]
    seen = [[list(evaluator.split_on_chunks(*one)) for one in sizes]]
    for seed in range(20):
        drawn = np.random.default_rng(seed).integers(1, 60, (12, 2)).tolist()
        configs = [{"num_agents": 1 + agents % 9, "max_episode_steps": steps} for agents, steps in drawn]
        buckets = evaluator.get_balanced_buckets_indexes(configs, 1 + seed % 5)
        seen.append([[int(index) for index in bucket] for bucket in buckets])
    seen.append(evaluator.get_env_config_cost({"num_agents": 5, "max_episode_steps": 32, "name": "Environment"}))
    changes = [{("seed",): 1, ("grid_config", "size"): 8}, {("seed",): 2}]
    return [*seen, evaluator.join_metrics_and_configs([{"ISR": 1.0}, {}], (), changes, {"name": "X"}, "Key")]


@scenario
def registry():
    """Registered names, and what unknown names raise."""
    holder = ResultsHolder()
    for infos in ([{}], [{"metrics": {"ISR": 0.5}}, {}], [{"metrics": {"CSR": 1.0}}]):
        holder.after_step(infos)
    ToolboxRegistry.register_env("Environment", create_env_base, Environment)
    ToolboxRegistry.register_run_func("short", lambda env, algo: {"is_short": algo})
    state = ToolboxRegistry.get_state()
    ToolboxRegistry.recreate_from_state(state)
    unknown = [
        raises(KeyError, ToolboxRegistry.create_algorithm, "nothing"),
        raises(KeyError, ToolboxRegistry.create_env, "nothing"),
        raises(KeyError, ToolboxRegistry.run_episode, None, None, "nothing"),
        raises(KeyError, ToolboxRegistry.create_env, "Environment", map_name="nowhere", num_agents=1),
    ]
    env = ToolboxRegistry.create_env("Environment", map_name="four-.*", num_agents=2, seed=3)
    env.reset()
    places = [env.get_global_obstacles(), env.get_global_agents_xy(), env.get_global_targets_xy()]
    maps = ToolboxRegistry.get_maps()
    kept = {"maps", "algorithms", "envs", "run_episode"} <= set(state)
    base = AlgoBase(seed=None, unknown=1).dict()
    del base["parallel_backend"]
    ran = ToolboxRegistry.run_episode(None, 3, "short")
    return [maps, holder.get_final(), repr(holder), unknown, places, kept, base, ran]


@scenario
def maps_of_many_resets():
    """Maps with marks and with letters, chosen again at each reset."""
    marked = {"x1": "@@..$$\n......", "x2": "......\n......\n......", "y1": "aA...\n.....", "y2": "a..A..\nb..B.."}
    ToolboxRegistry.register_maps(marked)
    seen = []
    for pattern in ("x.*", "x1", "y1", "y2"):
        env = create_env_base(Environment(map_name=pattern, num_agents=1, max_episode_steps=8))
        for seed in range(6):
            env.reset(seed=seed)
            seen.append([env.grid.get_obstacles().tolist(), env.grid.get_agents_xy(), env.grid.get_targets_xy()])
    return seen


if __name__ == "__main__":
    ToolboxRegistry.setup_logger("INFO", sink="log.txt")
    print(json.dumps({name: play() for name, play in SCENARIOS.items()}, default=lambda value: value.item()))
