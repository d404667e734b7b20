"""Tests what docs/training.md says about published maps among those of the shipped training runs."""

import json
import re
from pathlib import Path

from pogema_rs.baselines import load_config
from pogema_rs.baselines._episodes import Episodes
from pogema_rs.toolbox.generators.maze_generator import MazeGenerator, MazeRangeSettings
from pogema_rs.toolbox.generators.random_generator import MapRangeSettings, generate_map

ROOT = Path(__file__).resolve().parent.parent.parent
#: The seeds of pogema-toolbox's sets for validation and training.
PUBLISHED_SEEDS = range(128 + 2048)


def obstacles(text):
    """Returns the text of a map with `.` for every cell that is not an obstacle."""
    return re.sub(r"[^#\n]", ".", text.strip())


def shipped_maps():
    """Yields the text of each map of the shipped training runs."""
    longest = {}
    for path in sorted((ROOT / "policies" / "weights").glob("*/run.json")):
        run = json.loads(path.read_text(encoding="utf-8"))
        config = load_config(run["method"])
        environment, lanes = config.environment, config.schedule.lanes
        stored = run["config"]["environment"]
        assert (list(environment.maps), lanes) == (stored["maps"], run["config"]["schedule"]["lanes"]), path
        # Runs with equal seeds, lanes and crowds draw the same maps.
        key = (run["seed"], lanes, environment.maps, environment.kinds)
        if run["iterations"] > longest.get(str(key), (0, None))[0]:
            longest[str(key)] = (run["iterations"], (Episodes(environment, run["seed"], 1), lanes))
    assert len(longest) >= 3
    for iterations, (episodes, lanes) in longest.values():
        for number in range(iterations):
            yield from (obstacles(config["map"]) for config in episodes.of_iteration(number, lanes)[0])


def test_the_page_names_the_published_maps_among_those_of_the_shipped_runs():
    mazes, published = MazeRangeSettings(17, 21, 17, 21), {}
    for seed in PUBLISHED_SEEDS:
        published[obstacles(MazeGenerator.generate_maze(**mazes.sample(seed)))] = ("mazes", seed)
        published[obstacles(generate_map(MapRangeSettings().sample(seed)))] = ("random", seed)
    shipped = set(shipped_maps())
    found = sorted(published[text] for text in shipped & published.keys())
    assert {kind for kind, _ in found} == {"mazes"}
    seeds = " and ".join(str(seed) for _, seed in found)
    page = (ROOT / "docs" / "training.md").read_text(encoding="utf-8")
    assert f"{len(found)} of the {len(shipped):,} maps of the shipped training runs" in page
    assert f"with the seeds {seeds}" in page
