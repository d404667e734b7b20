"""Fuzzes saved environments for SECONDS seconds [default: 10]: state.py [SECONDS]

Each saved state is JSON. The fuzzer changes values, removes and copies parts, and overwrites, inserts or removes bytes.
The engine must reject the result with a ValueError, or play on. Any other error is a failure, and so is a run that
restores no state. If the fuzzer fails or hangs, `artifacts/state/last` holds the changed state.
"""

from __future__ import annotations

import json
import random
import resource
import signal
import sys
import time
from pathlib import Path
from typing import Any

from pogema_rs import GridConfig, pogema_v0
from pogema_rs._engine import Engine, restore_engine

VALUES = [
    None,
    True,
    -1,
    0,
    1,
    2**15,
    2**16,
    2**31,
    2**32,
    2**63 - 1,
    2**64 - 1,
    -(2**63),
    1e308,
    0.5,
    "",
    "soft",
    [],
    {},
]
MAX_BYTES = 4 << 30
MAX_SECONDS_PER_STATE = 10
LAST = Path(__file__).parent / "artifacts" / "state" / "last"


def saved_states() -> list[bytes]:
    states = []
    for on_target in ("finish", "nothing", "restart"):
        for is_persistent in (False, True):
            config = GridConfig(
                num_agents=3, size=6, seed=1, on_target=on_target, persistent=is_persistent, collision_system="soft"
            )
            env = pogema_v0(config)
            env.reset()
            for step in range(4):
                env.step([step % 5, 1, 2])
            engine = next(value for value in vars(env.unwrapped).values() if isinstance(value, Engine))
            states.append(engine.__reduce__()[1][0])
    return states


def places(value: Any) -> list[tuple[Any, Any]]:
    """Returns all places inside a JSON value: the container and its key or index."""
    found = []
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        found.append((value, key))
        found.extend(places(inner))
    return found


def changed(saved: bytes, rng: random.Random) -> bytes:
    if rng.random() < 0.2:
        place = rng.randrange(len(saved))
        return saved[:place] + bytes([rng.randrange(256)]) + saved[place + rng.randrange(3) :]
    state = json.loads(saved)
    for _ in range(rng.choice((1, 1, 2, 4))):
        holder, key = rng.choice(places(state))
        old = holder[key]
        kind = rng.randrange(5)
        if kind == 0 and isinstance(holder, list):
            holder.insert(key, old)
        elif kind == 1:
            del holder[key]
        elif kind == 2 and isinstance(old, int):
            holder[key] = old + rng.choice((-1, 1))
        elif kind == 3:
            other, other_key = rng.choice(places(state))
            holder[key] = json.loads(json.dumps(other[other_key]))
        else:
            holder[key] = rng.choice(VALUES)
    return json.dumps(state).encode()


def play(engine: Engine) -> None:
    engine.__reduce__()
    for action in (1, 4, 0):
        engine.step([action] * len(engine.active))


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    resource.setrlimit(resource.RLIMIT_AS, (MAX_BYTES, MAX_BYTES))
    states = saved_states()
    rng = random.Random()
    LAST.parent.mkdir(parents=True, exist_ok=True)
    tried = restored = 0
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        state = changed(rng.choice(states), rng)
        # The alarm ends the process even inside the engine, so the state is written first.
        LAST.write_bytes(state)
        signal.alarm(MAX_SECONDS_PER_STATE)
        try:
            engine = restore_engine(state)
        except ValueError:
            pass
        else:
            play(engine)
            restored += 1
        signal.alarm(0)
        tried += 1
    if not restored:
        sys.exit(f"state: none of {tried} states was restored")
    # `fuzz/run` looks for this word, which libFuzzer prints, too.
    print(f"Done {tried} states, {restored} of them restored")


main()
