"""Answers calls of a NumPy generator, given as JSON on standard input.

The request has two lists. `runs` holds runs as described in `calls/mod.rs`; the reply has a list of answers for each.
`near` holds calls that compare a double with thresholds; the reply has runs with answers for each, in which the first
double is at or near a threshold, or is the largest double below 1. A double is written as the 16 hexadecimal digits of
its bits, an error as null.
"""

import itertools
import json
import random
import struct
import sys

import numpy as np

MULTIPLIER = 0x2360ED051FC65DA44385DF649FCCF645
STATES = 1 << 128
LISTABLE = 2000


def to_double(bits):
    return struct.unpack(">d", bytes.fromhex(bits))[0]


def to_bits(double):
    return struct.pack(">d", double).hex()


def to_seed(words):
    """Returns the integer of these words, or if the last one is 0, the words as an array: an integer would lose it."""
    if words and not words[-1]:
        return np.array(words, dtype=np.uint32)
    return sum(word << 32 * index for index, word in enumerate(words))


def make_generator(start):
    if "words" in start:
        return np.random.default_rng(to_seed(start["words"]))
    initial, stream = map(int, start["pcg"])
    increment = (stream << 1 | 1) % STATES
    state = ((initial + increment) * MULTIPLIER + increment) % STATES
    pcg = np.random.PCG64()
    pcg.state = pcg.state | {"state": {"state": state, "inc": increment}, "has_uint32": 0, "uinteger": 0}
    return np.random.Generator(pcg)


def choice_index(generator, n):
    return int(generator.choice(list(range(n)) if n <= LISTABLE else n, 1)[0])


def choice_weighted(generator, weights):
    return int(generator.choice(len(weights), p=[to_double(weight) for weight in weights]))


def shuffle_list(generator, n):
    items = list(range(n))
    generator.shuffle(items)
    return items


def shuffle_rows(generator, n):
    rows = np.repeat(np.arange(n), 2).reshape(n, 2)
    generator.shuffle(rows)
    return rows[:, 1].tolist()


def shuffle_array(generator, n):
    items = np.arange(n)
    generator.shuffle(items)
    return items.tolist()


def binomial1_array(generator, p, n):
    return "".join(map(str, generator.binomial(1, to_double(p), size=n)))


CALLS = {
    "next_u32": lambda generator: int(generator.integers(0, 1 << 32, dtype=np.uint32)),
    "next_u64": lambda generator: int(generator.bit_generator.random_raw()),
    "random": lambda generator: to_bits(generator.random()),
    "uniform": lambda generator, lo, hi: to_bits(generator.uniform(to_double(lo), to_double(hi))),
    "integers": lambda generator, lo, hi: int(generator.integers(lo, hi)),
    "integers_array": lambda generator, lo, hi, n: generator.integers(lo, hi, size=n).tolist(),
    "choice_index": choice_index,
    "choice_weighted": choice_weighted,
    "shuffle_list": shuffle_list,
    "shuffle_rows": shuffle_rows,
    "shuffle_array": shuffle_array,
    "binomial1": lambda generator, p: bool(generator.binomial(1, to_double(p))),
    "binomial1_array": binomial1_array,
}


def answer(generator, call):
    arguments = dict(call)
    try:
        return CALLS[arguments.pop("call")](generator, **arguments)
    except (ValueError, OverflowError):
        return None


def answers(run):
    generator = make_generator(run["start"])
    return [answer(generator, call) for call in run["calls"]]


def thresholds(call):
    if "weights" in call:
        sums = list(itertools.accumulate(map(to_double, call["weights"])))
        return [total / sums[-1] for total in sums if sums[-1]]
    p = to_double(call["p"])
    return [max(p, 1 - p)]


def runs_near(call):
    """Yields runs of a call. The first double of each is at most two steps from a threshold, or the largest below 1."""
    pick = random.Random(json.dumps(call))
    middles = [round(threshold * 2**53) for threshold in thresholds(call) if 0 <= threshold <= 1]
    steps = {middle + shift for middle in middles for shift in range(-2, 3)} | {2**53 - 1}
    for step in sorted(step for step in steps if 0 <= step < 2**53):
        start = start_before(step << 11 | pick.getrandbits(11), pick)
        run = {"start": start, "calls": [call, {"call": "next_u64"}]}
        yield run | {"answers": answers(run)}


def start_before(draw, pick):
    """Returns an initial state of PCG64 whose first 64-bit draw is `draw`."""
    inverse = pow(MULTIPLIER, -1, STATES)
    stream = pick.getrandbits(127)
    increment = stream << 1 | 1
    high = pick.getrandbits(64)
    turn = high >> 58
    turned_back = (draw << turn | draw >> (64 - turn)) % (1 << 64)
    state = high << 64 | (turned_back ^ high)
    # One step leads to the draw, and seeding takes another step.
    initial = ((state - increment) * inverse - increment) * inverse - increment
    return {"pcg": [str(initial % STATES), str(stream)]}


def main():
    request = json.load(sys.stdin)
    reply = {
        "version": np.__version__,
        "answers": [answers(run) for run in request["runs"]],
        "near": [run for call in request["near"] for run in runs_near(call)],
    }
    json.dump(reply, sys.stdout)


if __name__ == "__main__":
    main()
