"""The oracle: POGEMA 1.4.0 itself behind a pipe. One JSON request per line in, one JSON response per line out.

Request   {"id", "config": GridConfig's fields, "register": {"name", "rows"} | null, "density": bool, "ops": [op, ...]}
  op      ["reset", seed | null]  ["step", [actions]]  ["astar"]  ["sample"]  ["back"]  ["history"]
Response  {"id", "records": [one per op], "warnings": [text, ...]}, and if the request failed
          "error": {"when": "request" | "register" | "config" | "make" | index of the op, "type", "message"}

Cells are [row, column] without the padding, except `global_xy` and `global_target_xy`, which are copied from POGEMA.
Windows of zeros and ones are hexadecimal, eight cells per byte, the first cell in the highest bit. Infinite floats and
NaN are strings. A request that exceeds POGEMA_ORACLE_TIMEOUT seconds [default: 20] ends with a `Timeout` error.
"""

import gc
import json
import math
import os
import platform
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

VERSION = "1.4.0"

try:
    import numpy as np
    import pogema

    if pogema.__version__ != VERSION:
        raise ImportError(f"found pogema {pogema.__version__}, expected {VERSION}")
    from pogema import GridConfig
    from pogema.grid_registry import GRID_STR_REGISTRY, RegisteredGrid

    from deadline import LIMIT, Timeout, deadline, disarm
    from episodes import Episodes, ProtocolError, Record
except (ImportError, ValueError) as failure:
    sys.exit(f"oracle: {' '.join(str(failure).split())}")


@contextmanager
def registered(grid: Record | None) -> Iterator[None]:
    """Registers the map of the request in POGEMA for the duration of the body."""
    if grid is None:
        yield
        return
    try:
        RegisteredGrid(grid["name"], "\n".join(grid["rows"]))
        yield
    finally:
        GRID_STR_REGISTRY.pop(grid["name"], None)


def describe(when: str | int, error: BaseException) -> Record:
    """Converts an exception to the form of the protocol."""
    return {"when": when, "type": type(error).__name__, "message": str(error)}


def parse(line: bytes) -> Record:
    """Parses a request, fills in defaults and checks types; POGEMA checks the fields of the config."""
    request = json.loads(line)
    if not isinstance(request, dict) or not {"id", "config", "ops"} <= request.keys():
        raise ProtocolError("expected a request: an object with `id`, `config` and `ops`")
    if unknown := request.keys() - {"id", "config", "register", "density", "ops"}:
        raise ProtocolError(f"unknown field `{min(unknown)}`")
    request = {"register": None, "density": False, **request}
    match request:
        case {"config": dict(), "register": None, "density": bool(), "ops": list()}:
            return request
        case {"config": dict(), "register": {"name": str(), "rows": list(rows)}, "density": bool(), "ops": list()}:
            if all(isinstance(row, str) for row in rows):
                return request
    expected = "`config` an object, `register` null or `name` and `rows`, `density` a bool, `ops` a list"
    raise ProtocolError(f"a field has the wrong type, expected {expected}")


def run(request: Record) -> Record:
    """Executes a request up to its end or its first error."""
    response: Record = {"id": request["id"], "records": []}
    when: str | int = "register"
    try:
        with deadline(LIMIT), registered(request["register"]):
            when = "config"
            config = GridConfig(**request["config"])
            when = "make"
            episodes = Episodes(config, request["density"])
            for index, op in enumerate(request["ops"]):
                when = index
                response["records"].append(episodes.perform(op))
    except (Exception, Timeout) as error:  # noqa: BLE001 - POGEMA may raise anything
        response["error"] = describe(when, error)
    finally:
        disarm()
    return response


def answer(line: bytes) -> Record:
    """Returns the response to one line, also to an invalid one."""
    try:
        request = parse(line)
    except (ValueError, RecursionError) as error:
        return {"id": None, "error": describe("request", error), "records": [], "warnings": []}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        response = run(request)
    return {**response, "warnings": [str(warning.message) for warning in caught]}


def to_native(value: Any) -> Any:
    """Converts values that JSON cannot encode: NumPy's numbers to Python's, other values to text."""
    return value.item() if isinstance(value, np.generic) else repr(value)


def with_text_floats(value: Any) -> Any:
    """Returns the same value with every float that is not finite as text."""
    if isinstance(value, dict):
        return {key: with_text_floats(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [with_text_floats(part) for part in value]
    return str(float(value)) if isinstance(value, float) and not math.isfinite(value) else value


def encode(response: Record) -> bytes:
    """Encodes a response as one line of JSON in ASCII."""
    encoder = json.JSONEncoder(default=to_native, allow_nan=False, separators=(",", ":"), check_circular=False)
    try:
        return encoder.encode(response).encode("ascii") + b"\n"
    except ValueError:
        return encoder.encode(with_text_floats(response)).encode("ascii") + b"\n"


def main() -> None:
    """Writes its versions, then answers requests until stdin ends."""
    out = open(os.dup(1), "wb")
    os.dup2(2, 1)  # anything else that is printed goes to stderr
    gc.freeze()
    versions = {"version": VERSION, "numpy": np.__version__, "python": platform.python_version()}
    try:
        out.write(encode({"oracle": "pogema", **versions}))
        out.flush()
        for line in sys.stdin.buffer:
            out.write(encode(answer(line)))
            out.flush()
    except (BrokenPipeError, KeyboardInterrupt):
        os._exit(1)


if __name__ == "__main__":
    main()
