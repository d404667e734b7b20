"""Tests of the oracle's protocol, run by the python that install.py prints: `python test_oracle.py`."""

import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pogema import BatchAStarAgent, GridConfig, pogema_v0
from pogema.wrappers.metrics import AgentsDensityWrapper

Config = dict[str, Any]

HERE = Path(__file__).resolve().parent
SMALL: Config = {"size": 6, "num_agents": 4, "obs_radius": 2, "seed": 3, "density": 0.2}
STEPS = [[1, 2, 3, 4], [4, 4, 2, 1], [0, 1, 2, 3]]


def unpacked(text: str, shape: tuple[int, ...]) -> NDArray[Any]:
    """The window that a hexadecimal string stands for."""
    bits = np.unpackbits(np.frombuffer(bytes.fromhex(text), np.uint8))
    size = int(np.prod(shape))
    assert not bits[size:].any()
    return bits[:size].reshape(shape)


def pictured(grid: NDArray[Any]) -> list[str]:
    """A 0/1 array as the oracle draws it."""
    return ["".join(".#"[int(cell)] for cell in row) for row in grid]


class Oracle:
    """The program under test in a process of its own."""

    def __init__(self, timeout: str = "20") -> None:
        environment = {**os.environ, "POGEMA_ORACLE_TIMEOUT": timeout}
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(
            [sys.executable, str(HERE / "oracle.py")], stdin=pipe, stdout=pipe, stderr=pipe, env=environment
        )
        assert self.process.stdin and self.process.stdout
        self.input, self.output = self.process.stdin, self.process.stdout
        self.greeting = json.loads(self.output.readline())

    def send(self, line: bytes) -> dict[str, Any]:
        """The response to a raw line."""
        self.input.write(line + b"\n")
        self.input.flush()
        response: dict[str, Any] = json.loads(self.output.readline(), parse_constant=self.refuse)
        return response

    @staticmethod
    def refuse(constant: str) -> None:
        """Strict JSON has no NaN."""
        raise ValueError(constant)

    def close(self) -> tuple[int, bytes, bytes]:
        """Ends the input; the exit code and whatever else was written."""
        out, err = self.process.communicate(timeout=30)
        return self.process.returncode, out, err


class OracleTest(unittest.TestCase):
    """Starts one oracle for all tests of a class."""

    timeout = "20"
    oracle: Oracle

    @classmethod
    def setUpClass(cls) -> None:
        cls.oracle = Oracle(cls.timeout)

    @classmethod
    def tearDownClass(cls) -> None:
        code, out, err = cls.oracle.close()
        assert (code, out, err) == (0, b"", b""), (code, out, err)

    def ask(self, config: dict[str, Any], *ops: Any, **fields: Any) -> dict[str, Any]:
        """The response to a request."""
        return self.oracle.send(json.dumps({"id": 7, "config": config, "ops": ops, **fields}).encode())

    def records(self, config: dict[str, Any], *ops: Any, **fields: Any) -> list[dict[str, Any]]:
        """The records of a request that must succeed."""
        response = self.ask(config, *ops, **fields)
        self.assertNotIn("error", response)
        records: list[dict[str, Any]] = response["records"]
        self.assertEqual((response["id"], len(records)), (7, len(ops)))
        return records

    def error(self, config: dict[str, Any], *ops: Any, **fields: Any) -> tuple[Any, str]:
        """When and with which exception a request fails."""
        error = self.ask(config, *ops, **fields)["error"]
        self.assertIsInstance(error["message"], str)
        return error["when"], error["type"]


class Episode(OracleTest):
    """What is recorded, held against the package called directly."""

    def test_greeting(self) -> None:
        python = "3.11." + str(sys.version_info.micro)
        expected = {"oracle": "pogema", "version": "1.4.0", "numpy": "1.26.4", "python": python}
        self.assertEqual(self.oracle.greeting, expected)

    def check_state(self, record: dict[str, Any], env: Any) -> None:
        """The state part of a record against a second environment."""
        grid = env.unwrapped.grid
        self.assertEqual(record["cells"], grid.get_agents_xy(ignore_borders=True))
        self.assertEqual(record["goals"], grid.get_targets_xy(ignore_borders=True))
        self.assertEqual(record["active"], list(grid.is_active.values()))
        self.assertEqual(record["on_goal"], env.unwrapped.was_on_goal)
        radius = env.grid_config.obs_radius
        occupied = [[row - radius, column - radius] for row, column in zip(*np.nonzero(grid.positions), strict=True)]
        self.assertEqual(record["occupied"], occupied)

    def check_observations(self, record: dict[str, Any], observations: list[Any], at_reset: bool) -> None:
        """The observations of a record against those of a second environment."""
        seen = record["observations"]
        self.assertNotIn("odd", seen)
        self.assertEqual(seen["dtype"], "float32")
        for agent, one in enumerate(observations):
            if seen["type"] == "default":
                np.testing.assert_array_equal(unpacked(seen["windows"][agent], (3, 5, 5)), one)
                continue
            for name in ("obstacles", "agents"):
                np.testing.assert_array_equal(unpacked(seen[name][agent], (5, 5)), one[name])
            for name in one.keys() - {"obstacles", "agents", "global_obstacles"}:
                self.assertEqual(seen[name][agent], list(one[name]))
        if seen["type"] == "MAPF":
            grid = observations[0]["global_obstacles"]
            expected = {"dtype": str(grid.dtype), "rows": pictured(grid)} if at_reset else None
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
        """A whole episode against a second environment."""
        config = {**config, "max_episode_steps": 3}
        first, *later = self.records(config, ["reset", None], *(["step", actions] for actions in STEPS))
        env = pogema_v0(grid_config=GridConfig(**config))
        observations, _ = env.reset()
        derived = {"width": 6, "height": 6, "size": 6, "density": 0.2, "num_agents": 4}
        self.assertEqual((first["op"], first["derived"]), ("reset", derived))
        self.assertEqual(first["map"], pictured(env.get_obstacles(ignore_borders=True)))
        dtype = "float64" if config["empty_outside"] else "int64"
        self.assertEqual(first["padded"], {"dtype": dtype, "rows": pictured(env.get_obstacles())})
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

    def test_occupied_shows_the_vanished_agent(self) -> None:
        config = {"map": "ab..AB", "collision_system": "soft", "obs_radius": 1}
        record = self.records(config, ["reset", None], ["step", [4, 4]])[1]
        self.assertEqual((record["cells"], record["occupied"]), ([[0, 1], [0, 2]], [[0, 2]]))

    def test_astar_forgets_at_reset(self) -> None:
        config = {**SMALL, "size": 4, "num_agents": 5, "observation_type": "POMAPF", "density": 0.1}
        records = self.records(config, *2 * [["reset", None], *6 * [["astar"]]])
        env, planner = pogema_v0(grid_config=GridConfig(**config)), BatchAStarAgent()
        observations, _ = env.reset()
        for record, again in zip(records[1:7], records[8:], strict=True):
            actions = planner.act(observations)
            observations, *_ = env.step(actions)
            self.assertEqual((record["op"], record["actions"]), ("astar", actions))
            self.assertEqual(record, again)

    def test_sample_continues_over_resets(self) -> None:
        records = self.records(SMALL, ["reset", None], ["sample"], ["reset", 5], ["sample"])
        generator = np.random.default_rng(SMALL["seed"])
        for record in (records[1], records[3]):
            self.assertEqual(record["actions"], generator.integers(5, size=4).tolist())
        self.assertEqual(records[0], records[2])

    def test_sampled_actions_are_rewritten_by_soft(self) -> None:
        config = {"map": "abAB", "collision_system": "soft", "obs_radius": 1, "seed": 0}
        records = self.records(config, ["reset", None], *20 * [["sample"]])[1:]
        self.assertTrue(any(record["actions"] != record["actions_after"] for record in records))

    def test_back_and_history(self) -> None:
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

    def test_pools_drift_over_resets_but_not_over_requests(self) -> None:
        config = {"map": ".....!", "seed": 5, "num_agents": 2, "obs_radius": 1}
        starts = [record["cells"] for record in self.records(config, *3 * [["reset", None]])]
        self.assertEqual(starts, [[[0, 4], [0, 3]], [[0, 0], [0, 2]], [[0, 4], [0, 1]]])
        self.assertEqual(self.records(config, ["reset", None])[0]["cells"], starts[0])

    def test_density_wrapper(self) -> None:
        config = {**SMALL, "observation_type": "POMAPF", "max_episode_steps": 1}
        metrics = self.records(config, ["reset", None], ["step", STEPS[0]], density=True)[1]["metrics"]
        env = AgentsDensityWrapper(pogema_v0(grid_config=GridConfig(**config)))
        env.reset()
        self.assertEqual(metrics, env.step(STEPS[0])[4][0]["metrics"])
        self.assertIn("avg_agents_density", metrics)

    def test_registered_map_lasts_for_its_request_only(self) -> None:
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

    def test_sequences_cycle_with_a_warning_each(self) -> None:
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


class Odd(OracleTest):
    """What breaks the expected form is told, not hidden."""

    def test_windows_cut_by_the_edge(self) -> None:
        config = {"map": "a.A", "obs_radius": 2, "observation_type": "POMAPF", "MOVES": [[0, 0], [0, 4]]}
        seen = self.records(config, ["reset", None], ["step", [1]])[1]["observations"]
        self.assertEqual(seen["odd"], ["obstacles[0] is float32 (5, 3)", "agents[0] is float32 (5, 3)"])
        self.assertEqual(unpacked(seen["agents"][0], (5, 3)).nonzero(), (2, 2))

    def test_strange_map_values(self) -> None:
        config = {"map": [[0, 2, 0, 0]], "obs_radius": 1, "seed": 1, "num_agents": 1}
        config |= {"agents_xy": [[0, 0]], "targets_xy": [[0, 3]], "observation_type": "MAPF"}
        record = self.records(config, ["reset", None])[0]
        self.assertEqual(record["map"], [".?.."])
        expected = ["obstacles[0] has values [2.0]", "global_obstacles has values [2.0]"]
        self.assertEqual(record["observations"]["odd"], expected)

    def test_goals_that_are_not_integers(self) -> None:
        config = {"map": "...", "obs_radius": 1, "seed": 1, "observation_type": "POMAPF"}
        config |= {"possible_agents_xy": [[0, 0]], "possible_targets_xy": [[0, 1.5]]}
        record = self.records(config, ["reset", None])[0]
        self.assertEqual(record["goals"], [[0, 1.5]])
        self.assertEqual(record["observations"]["odd"], ["target_xy[0] is (0, 1.5)"])

    def test_numbers_that_are_not_finite(self) -> None:
        config = {
            "map": [[0, 0, 1e999]],
            "obs_radius": 1,
            "possible_agents_xy": [[0, 0]],
            "possible_targets_xy": [[0, 1]],
        }
        line = json.dumps({"id": 1, "config": config, "ops": [["reset", None]]}).replace("Infinity", "1e999")
        self.assertEqual(self.oracle.send(line.encode())["records"][0]["derived"]["density"], "inf")

    def test_goal_lists_that_are_none(self) -> None:
        config = {**SMALL, "on_target": "restart"}
        record = self.records({**config, "max_episode_steps": 5000}, ["reset", None])[0]
        self.assertEqual((record["goal_lists"], "goal_lists_error" in record), (None, False))
        record = self.records({"map": "aA", "on_target": "restart", "obs_radius": 1}, ["reset", None])[0]
        self.assertIsNone(record["goal_lists"])
        self.assertIn("TypeError", record["goal_lists_error"])


class Failure(OracleTest):
    """Errors end a request, never the oracle."""

    def test_config_and_make(self) -> None:
        self.assertEqual(self.error({"size": 1}), ("config", "ValidationError"))
        self.assertEqual(self.error({"map": "?"}), ("config", "KeyError"))
        self.assertEqual(self.error({"integration": "rllib"}), ("make", "NotImplementedError"))
        self.assertEqual(self.error({"integration": "PettingZoo"}), ("make", "ProtocolError"))

    def test_an_op_that_fails_keeps_the_records_before_it(self) -> None:
        response = self.ask(SMALL, ["reset", None], ["step", STEPS[0]], ["step", [9, 9, 9, 9]], ["step", STEPS[0]])
        self.assertEqual((response["error"]["when"], response["error"]["type"]), (2, "IndexError"))
        self.assertEqual([record["op"] for record in response["records"]], ["reset", "step"])

    def test_the_package_speaks_for_itself(self) -> None:
        self.assertEqual(self.error(SMALL, ["step", STEPS[0]]), (0, "AttributeError"))
        self.assertEqual(self.error(SMALL, ["reset", None], ["step", [0]]), (1, "AssertionError"))
        self.assertEqual(self.error(SMALL, ["reset", None], ["back"]), (1, "AttributeError"))
        self.assertEqual(self.error(SMALL, ["reset", None], ["astar"]), (1, "IndexError"))
        self.assertEqual(self.error({**SMALL, "num_agents": 99}, ["reset", None]), (0, "OverflowError"))

    def test_two_agents_on_one_cell_in_soft(self) -> None:
        config = {
            "map": "...",
            "agents_xy": [[0, 0], [0, 0]],
            "targets_xy": [[0, 1], [0, 2]],
            "collision_system": "soft",
        }
        self.assertEqual(self.error(config, ["reset", None], ["step", [0, 0]]), (1, "RecursionError"))

    def test_bad_ops(self) -> None:
        for op in (["jump"], ["reset"], ["step", 1], ["astar", 1], [], "reset", None, 5, {"reset": None}):
            with self.subTest(op=op):
                self.assertEqual(self.error(SMALL, ["reset", None], op), (1, "ProtocolError"))

    def test_bad_register(self) -> None:
        self.assertEqual(
            self.error(SMALL, register={"name": "odd", "rows": ["..", "."]}), ("register", "AssertionError")
        )
        self.assertEqual(self.error(SMALL, register={"name": "odd", "rows": ["?"]}), ("register", "KeyError"))

    def test_malformed_lines(self) -> None:
        good = {"id": 1, "config": {}, "ops": []}
        broken: list[Any] = [
            {**good, "ops": 1},
            {**good, "config": []},
            {**good, "density": 1},
            {**good, "register": {"name": "a"}},
        ]
        broken += [
            {**good, "register": {"name": "a", "rows": [1]}},
            {**good, "more": 1},
            {"config": {}, "ops": []},
            [],
            3,
        ]
        lines = [json.dumps(request).encode() for request in broken]
        for line in [*lines, b"", b"{", b"\xff", b"[" * 100000, b"nonsense"]:
            with self.subTest(line=line[:40]):
                response = self.oracle.send(line)
                self.assertEqual((response["id"], response["error"]["when"]), (None, "request"))
                self.assertEqual((response["records"], response["warnings"]), ([], []))
        self.assertEqual(self.oracle.send(json.dumps(good).encode()), {"id": 1, "records": [], "warnings": []})


class Hanging(OracleTest):
    """On some pools POGEMA looks for ever for a goal that is not the agent's own cell, one padded, one not."""

    timeout = "0.5"
    config: ClassVar[Config] = {"map": "..", "obs_radius": 1, "seed": 3, "on_target": "restart", "max_episode_steps": 8}

    def test_goal_lists_that_never_end(self) -> None:
        config = {**self.config, "possible_agents_xy": [[0, 1]], "possible_targets_xy": [[0, 0]]}
        first, _, second = self.records(config, ["reset", None], ["step", [3]], ["step", [0]])
        self.assertEqual((first["goal_lists"], first["goals"]), (None, [[0, 0]]))
        self.assertIn("Timeout", first["goal_lists_error"])
        self.assertEqual((second["goals"], second["rewards"]), ([[0, 0]], [1.0]))

    def test_a_step_that_never_ends(self) -> None:
        response = self.ask(
            {**self.config, "possible_targets_xy": [[1, 1]]}, ["reset", None], ["step", [3]], ["reset", None]
        )
        self.assertEqual(response["records"][0]["goals"], [[0, 0]])
        self.assertEqual((response["error"]["when"], response["error"]["type"]), (1, "Timeout"))
        self.assertEqual(len(response["records"]), 1)
        self.assertEqual(len(self.records(SMALL, ["reset", None], ["step", STEPS[0]])), 2)


class Start(unittest.TestCase):
    """The oracle refuses to be something else."""

    def refused(self, script: str, *arguments: str, **environment: str) -> str:
        """The single line on stderr of a run that must fail with exit code 1."""
        command = [sys.executable, str(HERE / script), *arguments]
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **environment})
        self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (1, "", 1))
        return done.stderr

    def test_another_version(self) -> None:
        with tempfile.TemporaryDirectory() as directory:
            Path(directory, "pogema.py").write_text("__version__ = '2.0.0'\n")
            self.assertIn("1.4.0 is needed", self.refused("oracle.py", PYTHONPATH=directory))

    def test_a_senseless_timeout(self) -> None:
        for value in ("soon", "0", "-1", "nan"):
            self.refused("oracle.py", POGEMA_ORACLE_TIMEOUT=value)

    def test_install_spares_a_directory_that_is_not_its_own(self) -> None:
        with tempfile.TemporaryDirectory() as directory:
            target = Path(directory, "precious")
            target.mkdir()
            (target / "file").write_text("kept")
            self.assertIn("not a virtual environment", self.refused("install.py", str(target)))
            self.assertEqual((target / "file").read_text(), "kept")
        self.assertIn("usage", self.refused("install.py"))


if __name__ == "__main__":
    unittest.main()
