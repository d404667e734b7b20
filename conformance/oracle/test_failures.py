"""Tests the oracle with unusual and invalid requests: `python test_failures.py`."""

import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from episodes import pack
from oracle_client import HERE, SMALL, STEPS, Config, OracleTest, unpack_window


class Odd(OracleTest):
    """The oracle reports observations of an unexpected form."""

    def test_windows_cut_by_the_edge(self) -> None:
        config = {"map": "a.A", "obs_radius": 2, "observation_type": "POMAPF", "MOVES": [[0, 0], [0, 4]]}
        seen = self.records(config, ["reset", None], ["step", [1]])[1]["observations"]
        self.assertEqual(seen["odd"], ["obstacles[0] is float32 (5, 3)", "agents[0] is float32 (5, 3)"])
        self.assertEqual(unpack_window(seen["agents"][0], (5, 3)).nonzero(), (2, 2))

    def test_unexpected_map_values(self) -> None:
        config = {"map": [[0, 2, 0, 0]], "obs_radius": 1, "seed": 1, "num_agents": 1}
        config |= {"agents_xy": [[0, 0]], "targets_xy": [[0, 3]], "observation_type": "MAPF"}
        record = self.records(config, ["reset", None])[0]
        self.assertEqual(record["map"], [".?.."])
        expected = ["obstacles[0] has values [2.0]", "global_obstacles has values [2.0]"]
        self.assertEqual(record["observations"]["odd"], expected)

    def test_negative_zeros(self) -> None:
        odd: list[str] = []
        pack("agents", [np.array([[0.0, 1.0], [-0.0, 1.0]], dtype=np.float32)], (2, 2), odd)
        self.assertEqual(odd, ["agents[0] has values [-0.0]"])

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

    def test_goal_lists_that_are_null(self) -> None:
        config = {**SMALL, "on_target": "restart"}
        record = self.records({**config, "max_episode_steps": 5000}, ["reset", None])[0]
        self.assertEqual((record["goal_lists"], "goal_lists_error" in record), (None, False))
        record = self.records({"map": "aA", "on_target": "restart", "obs_radius": 1}, ["reset", None])[0]
        self.assertIsNone(record["goal_lists"])
        self.assertIn("TypeError", record["goal_lists_error"])


class Failure(OracleTest):
    """An error ends its request, but never the oracle."""

    def test_config_and_make(self) -> None:
        self.assertEqual(self.error({"size": 1}), ("config", "ValidationError"))
        self.assertEqual(self.error({"map": "?"}), ("config", "KeyError"))
        self.assertEqual(self.error({"integration": "rllib"}), ("make", "NotImplementedError"))
        self.assertEqual(self.error({"integration": "PettingZoo"}), ("make", "ProtocolError"))

    def test_an_op_that_fails_keeps_the_records_before_it(self) -> None:
        response = self.ask(SMALL, ["reset", None], ["step", STEPS[0]], ["step", [9, 9, 9, 9]], ["step", STEPS[0]])
        self.assertEqual((response["error"]["when"], response["error"]["type"]), (2, "IndexError"))
        self.assertEqual([record["op"] for record in response["records"]], ["reset", "step"])

    def test_errors_of_the_package_are_passed_through(self) -> None:
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
    """On some pools POGEMA searches for a goal forever, because it compares padded with unpadded cells."""

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
    """The oracle and its installer reject invalid settings."""

    def rejected(self, script: str, *arguments: str, **environment: str) -> str:
        """Runs a script that must fail with exit code 1; returns its single line on stderr."""
        command = [sys.executable, str(HERE / script), *arguments]
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **environment})
        self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (1, "", 1))
        return done.stderr

    def test_another_version(self) -> None:
        with tempfile.TemporaryDirectory() as directory:
            Path(directory, "pogema.py").write_text("__version__ = '2.0.0'\n")
            self.assertIn("expected 1.4.0", self.rejected("oracle.py", PYTHONPATH=directory))

    def test_an_invalid_timeout(self) -> None:
        for value in ("soon", "0", "-1", "nan"):
            self.assertIn("POGEMA_ORACLE_TIMEOUT", self.rejected("oracle.py", POGEMA_ORACLE_TIMEOUT=value))

    def test_install_keeps_a_directory_that_is_not_an_environment(self) -> None:
        with tempfile.TemporaryDirectory() as directory:
            target = Path(directory, "precious")
            target.mkdir()
            (target / "file").write_text("kept")
            self.assertIn("not a virtual environment", self.rejected("install.py", str(target)))
            self.assertEqual((target / "file").read_text(), "kept")
        self.assertIn("usage", self.rejected("install.py"))


if __name__ == "__main__":
    unittest.main()
