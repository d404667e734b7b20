"""Answers requests with POGEMA 1.4.0.

Reads requests from stdin and writes the results to stdout. A request is a script to play, or the number of a config for
which to draw instances. The length of each value precedes the value.
"""

from __future__ import annotations

import pickle
import sys
from typing import Any, BinaryIO

import generators
from player import Package, Player


def send(pipe: BinaryIO, value: Any) -> None:
    """Writes one value."""
    data = pickle.dumps(value, protocol=5)
    pipe.write(len(data).to_bytes(8, "little") + data)
    pipe.flush()


def receive(pipe: BinaryIO) -> Any:
    """Reads one value; raises EOFError at the end of the input."""
    head = pipe.read(8)
    if len(head) < 8:
        raise EOFError
    return pickle.loads(pipe.read(int.from_bytes(head, "little")))


def main() -> None:
    """Serves until the input ends."""
    import pogema.generator
    from pogema.envs import _make_pogema
    from pogema.grid import Grid

    import pogema
    from pogema import grid_registry

    out, sys.stdout = sys.stdout.buffer, sys.stderr
    send(out, pogema.__version__)
    package = Package(pogema.GridConfig, _make_pogema, Grid, grid_registry)
    while True:
        try:
            script = receive(sys.stdin.buffer)
        except EOFError:
            return
        if isinstance(script, int):
            send(out, generators.drawn(pogema.generator, pogema.GridConfig, script))
        else:
            send(out, Player(package).play(script))


if __name__ == "__main__":
    main()
