"""A port that misbehaves in `hello` or, once per folder, in its third step.

Its arguments are the name of the misbehaviour and the folder.
"""

import json
import os
import subprocess
import sys
import time

WAY, FOLDER = sys.argv[1:]
HELLO = {
    "protocol": "pogema-conform/1",
    "name": "bad",
    "version": "1",
    "profiles": ["core", "observations"] if WAY == "short-window" else ["core"],
    "collision": ["priority"],
    "on_goal": ["finish"],
    "observation": ["default"],
}
steps = 0


def state(request):
    """Returns a well-formed state. All agents stay at their starts, because no test checks moves."""
    instance = request["instance"]
    cells = instance["starts"]
    return {"cells": cells, "goals": [goals[0] for goals in instance["goals"]], "active": [True] * len(cells)}


def print_line(text):
    """Prints a line and flushes the output."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def is_first():
    """Returns whether this is the first misbehaviour in this folder, and marks the folder."""
    try:
        os.close(os.open(f"{FOLDER}/marker", os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return False
    return True


def misbehave(answer):
    """Misbehaves as `WAY` says."""
    if WAY == "exit":
        print("the reason is here", file=sys.stderr, flush=True)
        sys.exit(7)
    if WAY == "abort":
        os.abort()
    if WAY == "hang":
        time.sleep(3600)
    if WAY == "garbage":
        print_line("Traceback (most recent call last):")
    if WAY == "half-line":
        sys.stdout.write('{"cells": [[')
        sys.stdout.flush()
        os._exit(0)
    if WAY == "half-line-then-hang":
        sys.stdout.write('{"cells": [[')
        sys.stdout.flush()
        time.sleep(3600)
    if WAY == "huge-line":
        block = "x" * (1 << 20)
        for _ in range(80):
            sys.stdout.write(block)
        print_line("")
    if WAY == "binary":
        sys.stdout.buffer.write(b"\xff\xfe\x00\n")
        sys.stdout.flush()
    if WAY == "wrong-length":
        print_line(json.dumps({**answer, "rewards": answer["rewards"] + [0]}))
    if WAY == "left-out":
        answer.pop("truncated")
        print_line(json.dumps(answer))
    if WAY == "nan":
        print_line(json.dumps({**answer, "rewards": [float("nan")] * len(answer["rewards"])}))
    if WAY == "null":
        print_line("null")
    if WAY == "short-window":
        print_line(json.dumps({**answer, "observations": [[0, 1]] * len(answer["cells"])}))
    if WAY == "twice":
        # The two lines are short and go out in one write, so that the second one arrives before the next request.
        print_line(json.dumps(answer) + "\n{}")
    if WAY == "stderr-flood":
        for _ in range(200_000):
            print("a very long complaint about nothing at all, over and over", file=sys.stderr)
        print("the last words", file=sys.stderr, flush=True)
        sys.exit(1)
    if WAY == "closes-stdout":
        os.close(1)
        time.sleep(3600)
    if WAY == "fork":
        # The child outlives the port and holds its pipes open.
        child = subprocess.Popen(["sleep", "4321"])
        with open(f"{FOLDER}/pids", "a", encoding="ascii") as pids:
            print(child.pid, file=pids)
        os._exit(1)
    if WAY == "deaf":
        print_line(json.dumps(answer))
        time.sleep(3600)


start = {}
if WAY == "hello-without-protocol":
    print_line('{"name": "something else"}')
    time.sleep(3600)
for line in sys.stdin:
    request = json.loads(line)
    if request["type"] == "hello":
        print_line(json.dumps({**HELLO, "protocol": "other/9"} if WAY == "other-protocol" else HELLO))
    elif request["type"] == "reset":
        start = state(request)
        if WAY == "short-window":
            side = 2 * request["instance"]["config"]["radius"] + 1
            start["observations"] = [[0] * (3 * side * side)] * len(start["cells"])
        print_line(json.dumps(start))
    elif request["type"] == "step":
        steps += 1
        flags = [False] * len(start["cells"])
        reply = {**start, "rewards": [0] * len(flags), "terminated": flags, "truncated": flags}
        if steps == 3 and is_first():
            misbehave(reply)
        else:
            print_line(json.dumps(reply))
    else:
        break
