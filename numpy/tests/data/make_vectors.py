"""Writes vectors.json into the folder of this file. Run it with NumPy 1.26.4."""

import json
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE.parent))

from live import CALLS, answers, runs_near, to_bits  # noqa: E402

SEEDS = [0, 1, 42, 2**31 - 1, 2**32, 2**63 - 2, 2**64 - 1, 2**64, 2**130, 2**200 + 3]
LARGEST = 2**63 - 1
RANGES = [
    (0, 1), (0, 2), (0, 7), (-3, 5), (0, 1000), (0, 2**31 - 1), (0, 2**31), (0, 2**31 + 1), (0, 2**32 - 1), (0, 2**32),
    (0, 2**32 + 1), (-(2**33), 2**33 + 1), (-(2**62), 2**62), (-LARGEST - 1, 1), (-LARGEST - 1, LARGEST),
    (3, 3), (4, 3),
]  # fmt: skip
WEIGHTS = [
    [1.0], [0.5, 0.25, 0.25], [0.75, 0.25], [1 / 3] * 3, [0.1] * 10, [0.0, 1.0, 0.0], [0.2, 0.2], [-0.5, 1.5],
    # Sums at the tolerance. Without compensated summation the last one would be accepted.
    [0.5, 0.5 + 2**-26], [0.5, 0.5 + 2**-26 + 2**-52], [0.24, 0.22, 0.31, 0.1, 0.1300000149011613],
]  # fmt: skip
PROBABILITIES = [0.0, 5e-324, 0.1, 0.3, 1 / 3, 0.5, float(np.nextafter(0.5, 1)), 0.7, 0.999, 1.0, 1.5, float("nan")]
UNIFORMS = [(0.0, 1.0), (-1.0, 3.0), (0.75, 0.85), (2.0, 2.0), (1e300, 1.5e308), (3.0, 1.0), (float("-inf"), 0.0)]
LENGTHS = [0, 1, 2, 3, 10, 17, 33]


def to_words(number):
    return [number >> shift & 0xFFFFFFFF for shift in range(0, max(number.bit_length(), 1), 32)]


def seeding(words):
    sequence = np.random.SeedSequence(np.array(words, dtype=np.uint32))
    return {
        "words": words,
        "pool": sequence.pool.tolist(),
        "state_u32": sequence.generate_state(8).tolist(),
        "state_u64": sequence.generate_state(4, np.uint64).tolist(),
    }


def calls_by_topic():
    draws = [{"call": name} for name in "next_u32 next_u64 random next_u32 next_u32 random next_u32 next_u64".split()]
    ends = [{"lo": lo, "hi": hi} for lo, hi in RANGES]
    lists = [{"weights": list(map(to_bits, weights))} for weights in WEIGHTS]
    chances = [{"p": to_bits(p)} for p in PROBABILITIES]
    return {
        "draws": draws,
        "uniform": [{"call": "uniform", "lo": to_bits(lo), "hi": to_bits(hi)} for lo, hi in UNIFORMS],
        "integers": [{"call": "integers"} | pair for pair in ends],
        "integers_array": [{"call": "integers_array", "n": 5} | pair for pair in ends],
        "choice_index": [{"call": "choice_index", "n": n} for n in LENGTHS],
        "choice_weighted": [{"call": "choice_weighted"} | weights for weights in lists],
        "shuffle_list": [{"call": "shuffle_list", "n": n} for n in LENGTHS],
        "shuffle_rows": [{"call": "shuffle_rows", "n": n} for n in LENGTHS],
        "shuffle_array": [{"call": "shuffle_array", "n": n} for n in LENGTHS],
        "binomial1": [{"call": "binomial1"} | chance for chance in chances],
        "binomial1_array": [{"call": "binomial1_array", "n": 24} | chance for chance in chances],
    }


def mixed(topics):
    """Returns the first call of every topic, then the second of every topic, and so on."""
    longest = max(map(len, topics.values()))
    return [calls[turn] for turn in range(longest) for calls in topics.values() if turn < len(calls)]


def run(seed, calls):
    # A final draw of each kind shows that both streams are at the same position.
    made = {"start": {"words": to_words(seed)}, "calls": [*calls, {"call": "next_u32"}, {"call": "next_u64"}]}
    return made | {"answers": answers(made)}


def to_lines(values):
    return ",\n".join(map(json.dumps, values))


def main():
    assert np.__version__ == "1.26.4", np.__version__
    topics = calls_by_topic()
    assert {call["call"] for calls in topics.values() for call in calls} == {*CALLS}
    runs = {topic: [run(42, calls)] for topic, calls in topics.items()}
    runs["mixed"] = [run(seed, mixed(topics)) for seed in SEEDS]
    runs["long_shuffle"] = [run(42, [{"call": "shuffle_list", "n": 400}])]
    uneven = {"call": "choice_weighted", "weights": [to_bits(0.5), to_bits(0.5 + 2**-26)]}
    near = [*topics["binomial1"], uneven]
    runs["near"] = [made for call in near for made in runs_near(call)]
    entropies = [to_words(seed) for seed in SEEDS] + [[], [7, 0], [7, 0, 0, 0, 0], [*range(12)]]
    lines = ['{"seeding": [', to_lines(map(seeding, entropies)), '], "runs": {']
    lines.append(",\n".join(f'"{topic}": [\n{to_lines(made)}]' for topic, made in runs.items()))
    (HERE / "vectors.json").write_text("\n".join(lines) + "}}\n")


if __name__ == "__main__":
    main()
