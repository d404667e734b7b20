"""A port that goes wrong in the way that its argument names, in its third step, once in the life of a folder."""

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


def state(question):
    """Whatever the form asks for: everybody stays at the start, which is not what is checked here."""
    instance = question["instance"]
    cells = instance["starts"]
    return {"cells": cells, "goals": [goals[0] for goals in instance["goals"]], "active": [True] * len(cells)}


def say(text):
    """One line."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def is_first():
    """Whether no port went wrong in this folder before; from now on one has."""
    try:
        os.close(os.open(f"{FOLDER}/marker", os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return False
    return True


def go_wrong(answer):
    """Does what the argument names, or gives an answer that is wrong in its form."""
    if WAY == "exit":
        print("the reason is here", file=sys.stderr, flush=True)
        sys.exit(7)
    if WAY == "abort":
        os.abort()
    if WAY == "hang":
        time.sleep(3600)
    if WAY == "garbage":
        say("Traceback (most recent call last):")
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
        say("")
    if WAY == "binary":
        sys.stdout.buffer.write(b"\xff\xfe\x00\n")
        sys.stdout.flush()
    if WAY == "wrong-length":
        say(json.dumps({**answer, "rewards": answer["rewards"] + [0]}))
    if WAY == "left-out":
        answer.pop("truncated")
        say(json.dumps(answer))
    if WAY == "nan":
        say(json.dumps({**answer, "rewards": [float("nan")] * len(answer["rewards"])}))
    if WAY == "null":
        say("null")
    if WAY == "short-window":
        say(json.dumps({**answer, "observations": [[0, 1]] * len(answer["cells"])}))
    if WAY == "twice":
        # At once, so that the second line is there before the next question.
        say(json.dumps(answer) + "\n" + json.dumps(answer))
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
        say(json.dumps(answer))
        time.sleep(3600)


start = {}
if WAY == "not-in-hello":
    say('{"name": "something else"}')
    time.sleep(3600)
for line in sys.stdin:
    question = json.loads(line)
    if question["type"] == "hello":
        say(json.dumps({**HELLO, "protocol": "other/9"} if WAY == "other-protocol" else HELLO))
    elif question["type"] == "reset":
        start = state(question)
        if WAY == "short-window":
            side = 2 * question["instance"]["config"]["radius"] + 1
            start["observations"] = [[0] * (3 * side * side)] * len(start["cells"])
        say(json.dumps(start))
    elif question["type"] == "step":
        steps += 1
        flags = [False] * len(start["cells"])
        reply = {**start, "rewards": [0] * len(flags), "terminated": flags, "truncated": flags}
        if steps == 3 and is_first():
            go_wrong(reply)
        else:
            say(json.dumps(reply))
    else:
        break
