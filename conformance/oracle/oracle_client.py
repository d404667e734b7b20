"""The oracle as its tests speak to it: over a pipe, line by line."""

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
