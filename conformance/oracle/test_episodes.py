"""Compares whole episodes of the oracle with direct calls to POGEMA: `python test_episodes.py`."""

import sys
import unittest
from typing import Any

import numpy as np
from pogema import BatchAStarAgent, GridConfig, pogema_v0
from pogema.wrappers.metrics import AgentsDensityWrapper

from oracle_client import SMALL, STEPS, OracleTest, draw_grid, unpack_window


class Episode(OracleTest):
    """The oracle's records equal the results of direct calls to POGEMA."""

    def test_greeting(self) -> None:
        python = "3.11." + str(sys.version_info.micro)
        expected = {"oracle": "pogema", "version": "1.4.0", "numpy": "1.26.4", "python": python}
        self.assertEqual(self.oracle.greeting, expected)

    def check_state(self, record: dict[str, Any], env: Any) -> None:
        """Compares the state in a record with a second environment."""
        grid = env.unwrapped.grid
        self.assertEqual(record["cells"], grid.get_agents_xy(ignore_borders=True))
        self.assertEqual(record["goals"], grid.get_targets_xy(ignore_borders=True))
        self.assertEqual(record["active"], list(grid.is_active.values()))
        self.assertEqual(record["on_goal"], env.unwrapped.was_on_goal)
        radius = env.grid_config.obs_radius
        occupied = [[row - radius, column - radius] for row, column in zip(*np.nonzero(grid.positions), strict=True)]
        self.assertEqual(record["occupied"], occupied)

    def check_observations(self, record: dict[str, Any], observations: list[Any], at_reset: bool) -> None:
        """Compares the observations in a record with those of a second environment."""
        seen = record["observations"]
        self.assertNotIn("odd", seen)
        self.assertEqual(seen["dtype"], "float32")
        for agent, one in enumerate(observations):
            if seen["type"] == "default":
                np.testing.assert_array_equal(unpack_window(seen["windows"][agent], (3, 5, 5)), one)
                continue
            for name in ("obstacles", "agents"):
                np.testing.assert_array_equal(unpack_window(seen[name][agent], (5, 5)), one[name])
            for name in one.keys() - {"obstacles", "agents", "global_obstacles"}:
                self.assertEqual(seen[name][agent], list(one[name]))
        if seen["type"] == "MAPF":
            grid = observations[0]["global_obstacles"]
            expected = {"dtype": str(grid.dtype), "rows": draw_grid(grid)} if at_reset else None
            self.assertEqual(seen["global_obstacles"], expected)

    def test_each_observation_type_and_goal_rule(self) -> None:
        for kind in ("default", "POMAPF", "MAPF"):
            for rule in ("finish", "nothing", "restart"):
                for empty in (True, False):
                    with self.subTest(kind=kind, rule=rule, empty=empty):
                        self.check_episode(
                            {**SMALL, "observation_type": kind, "on_target": rule, "empty_outside": empty}
                        )

    def check_episode(self, config: dict[str, Any]) -> None:
        """Compares a whole episode with a second environment."""
        config = {**config, "max_episode_steps": 3}
        first, *later = self.records(config, ["reset", None], *(["step", actions] for actions in STEPS))
        env = pogema_v0(grid_config=GridConfig(**config))
        observations, _ = env.reset()
        derived = {"width": 6, "height": 6, "size": 6, "density": 0.2, "num_agents": 4}
        self.assertEqual((first["op"], first["derived"]), ("reset", derived))
        self.assertEqual(first["map"], draw_grid(env.get_obstacles(ignore_borders=True)))
        dtype = "float64" if config["empty_outside"] else "int64"
        self.assertEqual(first["padded"], {"dtype": dtype, "rows": draw_grid(env.get_obstacles())})
        self.check_state(first, env)
        self.check_observations(first, observations, at_reset=True)
        self.assertEqual("goal_lists" in first, config["on_target"] == "restart")
        if config["on_target"] == "restart":
            lists = env.get_lifelong_targets_xy(ignore_borders=True)
            self.assertEqual(first["goal_lists"], [[list(goal) for goal in goals] for goals in lists])
        for actions, record in zip(STEPS, later, strict=True):
            observations, rewards, terminated, truncated, infos = env.step(list(actions))
            self.assertEqual((record["op"], record["actions"], record["actions_after"]), ("step", actions, actions))
            self.check_state(record, env)
            self.check_observations(record, observations, at_reset=False)
            self.assertEqual((record["rewards"], record["terminated"]), (rewards, terminated))
            self.assertEqual((record["truncated"], record["metrics"]), (truncated, infos[0].get("metrics")))
            self.assertEqual(record["infos_active"], [info["is_active"] for info in infos])
        self.assertTrue(later[-1]["metrics"])

    def test_soft_rewrites_the_actions_of_a_swap(self) -> None:
        config = {"map": "abAB", "collision_system": "soft", "obs_radius": 1}
        record = self.records(config, ["reset", None], ["step", [4, 3]])[1]
        self.assertEqual((record["actions"], record["actions_after"]), ([4, 3], [0, 0]))
        self.assertEqual(record["cells"], [[0, 0], [0, 1]])

    def test_occupied_lacks_the_vanished_agent(self) -> None:
        config = {"map": "ab..AB", "collision_system": "soft", "obs_radius": 1}
        record = self.records(config, ["reset", None], ["step", [4, 4]])[1]
        self.assertEqual((record["cells"], record["occupied"]), ([[0, 1], [0, 2]], [[0, 2]]))

    def test_reset_clears_astar(self) -> None:
        config = {**SMALL, "size": 4, "num_agents": 5, "observation_type": "POMAPF", "density": 0.1}
        records = self.records(config, *2 * [["reset", None], *6 * [["astar"]]])
        env, planner = pogema_v0(grid_config=GridConfig(**config)), BatchAStarAgent()
        observations, _ = env.reset()
        for record, again in zip(records[1:7], records[8:], strict=True):
            actions = planner.act(observations)
            observations, *_ = env.step(actions)
            self.assertEqual((record["op"], record["actions"]), ("astar", actions))
            self.assertEqual(record, again)

    def test_resets_do_not_restart_the_sample_stream(self) -> None:
        records = self.records(SMALL, ["reset", None], ["sample"], ["reset", 5], ["sample"])
        generator = np.random.default_rng(SMALL["seed"])
        for record in (records[1], records[3]):
            self.assertEqual(record["actions"], generator.integers(5, size=4).tolist())
        self.assertEqual(records[0], records[2])

    def test_sampled_actions_are_rewritten_by_soft(self) -> None:
        config = {"map": "abAB", "collision_system": "soft", "obs_radius": 1, "seed": 0}
        records = self.records(config, ["reset", None], *20 * [["sample"]])[1:]
        self.assertTrue(any(record["actions"] != record["actions_after"] for record in records))

    def test_back_removes_the_last_state_from_the_history(self) -> None:
        config = {"map": "a.A", "persistent": True, "obs_radius": 1}
        ops = [["reset", None], ["back"], ["step", [4]], ["step", [4]], ["history"], ["back"], ["history"]]
        _, refused, _, arrived, full, back, shorter = self.records(config, *ops)
        self.assertEqual((refused["op"], refused["moved"]), ("back", False))
        self.assertEqual((arrived["cells"], arrived["active"], arrived["metrics"]), ([[0, 2]], [False], None))
        states = [[0, 0, 0, 2, 0, True], [0, 1, 0, 2, 1, True], [0, 2, 0, 2, 2, False]]
        self.assertEqual((full["full"], full["changes"]), ([states], [states]))
        self.assertEqual((back["moved"], back["cells"], back["active"]), (True, [[0, 1]], [True]))
        self.assertEqual(shorter, {"op": "history", "full": [states[:2]], "changes": [states[:2]]})

    def test_history_repeats_idle_states(self) -> None:
        config = {"map": "a.A", "persistent": True, "obs_radius": 1}
        record = self.records(config, ["reset", None], ["step", [0]], ["step", [4]], ["history"])[3]
        changes = [[0, 0, 0, 2, 0, True], [0, 1, 0, 2, 2, True]]
        self.assertEqual(record["changes"], [changes])
        self.assertEqual(record["full"], [[changes[0], changes[0], changes[1]]])

    def test_pools_change_between_resets_but_not_between_requests(self) -> None:
        config = {"map": ".....!", "seed": 5, "num_agents": 2, "obs_radius": 1}
        starts = [record["cells"] for record in self.records(config, *3 * [["reset", None]])]
        self.assertEqual(starts, [[[0, 4], [0, 3]], [[0, 0], [0, 2]], [[0, 4], [0, 1]]])
        self.assertEqual(self.records(config, ["reset", None])[0]["cells"], starts[0])

    def test_density_adds_the_metric_of_the_wrapper(self) -> None:
        config = {**SMALL, "observation_type": "POMAPF", "max_episode_steps": 1}
        metrics = self.records(config, ["reset", None], ["step", STEPS[0]], density=True)[1]["metrics"]
        env = AgentsDensityWrapper(pogema_v0(grid_config=GridConfig(**config)))
        env.reset()
        self.assertEqual(metrics, env.step(STEPS[0])[4][0]["metrics"])
        self.assertIn("avg_agents_density", metrics)

    def test_registered_map_exists_only_during_its_request(self) -> None:
        config = {**SMALL, "map_name": "own", "num_agents": 1}
        rows = ["..#.", "....", ".#.."]
        for _ in range(2):
            record = self.records(config, ["reset", None], register={"name": "own", "rows": rows})[0]
            self.assertEqual((record["map"], record["derived"]["width"]), (rows, 6))
        self.assertEqual(len(self.records(config, ["reset", None])[0]["map"]), 6)

    def test_warnings_are_captured(self) -> None:
        config = {"map": [[1, 0, 0]], "agents_xy": [[0, 0]], "targets_xy": [[0, 2]], "obs_radius": 1}
        response = self.ask(config, ["reset", None])
        self.assertEqual(len(response["warnings"]), 1)
        self.assertIn("start point (0, 0)", response["warnings"][0])
        self.assertEqual(self.ask(SMALL, ["reset", None])["warnings"], [])

    def test_each_cycle_of_a_sequence_triggers_a_warning(self) -> None:
        config = {
            "map": "...",
            "agents_xy": [[0, 0]],
            "targets_xy": [[[0, 1], [0, 0]]],
            "obs_radius": 1,
            "on_target": "restart",
        }
        response = self.ask(config, ["reset", None], *[["step", [action]] for action in (4, 3, 4, 3)])
        self.assertEqual(response["records"][0]["goal_lists"], [[[0, 1], [0, 0]]])
        self.assertEqual(len(response["warnings"]), 2)


if __name__ == "__main__":
    unittest.main()
