"""The client that the oracle's tests use: sends requests over a pipe, line by line."""

import json
import os
import subprocess
import sys
import unittest
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Config = dict[str, Any]

HERE = Path(__file__).resolve().parent
SMALL: Config = {"size": 6, "num_agents": 4, "obs_radius": 2, "seed": 3, "density": 0.2}
STEPS = [[1, 2, 3, 4], [4, 4, 2, 1], [0, 1, 2, 3]]


def unpack_window(text: str, shape: tuple[int, ...]) -> NDArray[Any]:
    """Decodes a window from a hexadecimal string."""
    bits = np.unpackbits(np.frombuffer(bytes.fromhex(text), np.uint8))
    size = int(np.prod(shape))
    assert not bits[size:].any()
    return bits[:size].reshape(shape)


def draw_grid(grid: NDArray[Any]) -> list[str]:
    """Draws a 0/1 array as rows of text, in the oracle's format."""
    return ["".join(".#"[int(cell)] for cell in row) for row in grid]


class Oracle:
    """The oracle in its own process."""

    def __init__(self, timeout: str = "20") -> None:
        environment = {**os.environ, "POGEMA_ORACLE_TIMEOUT": timeout}
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(
            [sys.executable, str(HERE / "oracle.py")], stdin=pipe, stdout=pipe, stderr=pipe, env=environment
        )
        assert self.process.stdin and self.process.stdout
        self.input, self.output = self.process.stdin, self.process.stdout
        line = self.output.readline()
        if not line:
            raise RuntimeError(f"the oracle did not start: {self.close()[2].decode()}")
        self.greeting = json.loads(line)

    def send(self, line: bytes) -> dict[str, Any]:
        """Sends a raw line; returns the response."""
        self.input.write(line + b"\n")
        self.input.flush()
        response: dict[str, Any] = json.loads(self.output.readline(), parse_constant=self.reject)
        return response

    @staticmethod
    def reject(constant: str) -> None:
        """Rejects NaN and infinity, which strict JSON does not allow."""
        raise ValueError(f"the oracle sent {constant}, expected strict JSON")

    def close(self) -> tuple[int, bytes, bytes]:
        """Closes the input; returns the exit code and the remaining output."""
        try:
            out, err = self.process.communicate(timeout=30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
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
        """Sends a request; returns the response."""
        return self.oracle.send(json.dumps({"id": 7, "config": config, "ops": ops, **fields}).encode())

    def records(self, config: dict[str, Any], *ops: Any, **fields: Any) -> list[dict[str, Any]]:
        """Sends a request that must succeed; returns its records."""
        response = self.ask(config, *ops, **fields)
        self.assertNotIn("error", response)
        records: list[dict[str, Any]] = response["records"]
        self.assertEqual((response["id"], len(records)), (7, len(ops)))
        return records

    def error(self, config: dict[str, Any], *ops: Any, **fields: Any) -> tuple[Any, str]:
        """Sends a request that must fail; returns the `when` and the `type` of the error."""
        error = self.ask(config, *ops, **fields)["error"]
        self.assertIsInstance(error["message"], str)
        return error["when"], error["type"]
