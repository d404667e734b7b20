"""Compares the speed of this project and of ONNX Runtime on the published networks, on one thread, in one run.

Both take the same batches.

python3.11 benches/peers/networks.py WEIGHTS [--rounds N]

WEIGHTS is the folder with `follower-lite.onnx` and `cost-tracer.onnx`. Install numpy, onnx and onnxruntime, and build
the program of this project with `cargo build --release -p pogema-policies --example forwards`. The peers take turns.
Only processor time counts, and only the shortest of many measurements, because the machine may do other work. Rates and
ratios are medians over the rounds.
"""

import argparse
import statistics
import subprocess
import time
from pathlib import Path

import numpy
import onnx
import onnxruntime

OURS = Path(__file__).resolve().parent.parent.parent / "target/release/examples/forwards"
NETWORKS = {"follower-lite": (2, 7, 7), "cost-tracer": (2, 11, 11)}
TIMES, TIME = 60, 0.004


def session(path):
    """Returns a session of the graph up to the logits, for batches of any size."""
    model = onnx.utils.Extractor(onnx.load(path)).extract_model(["obs"], ["action_logits"])
    for value in (model.graph.input[0], model.graph.output[0]):
        value.type.tensor_type.shape.dim[0].dim_param = "batch"
    del model.graph.value_info[:]
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(model.SerializeToString(), options, providers=["CPUExecutionProvider"])


def theirs(network, shape, batch):
    """Returns the forward passes per second of ONNX Runtime."""
    size = batch * numpy.prod(shape)
    windows = (numpy.arange(size) * 7919 % 3 - 1).astype(numpy.float32).reshape(batch, *shape)
    # Many passes run between two readings of the clock, so that the readings take negligible time.
    repeats, best = -(-256 // batch), float("inf")
    for _ in range(TIMES):
        start, count = time.process_time(), 0
        while (now := time.process_time()) - start < TIME:
            for _ in range(repeats):
                network.run(None, {"obs": windows})
            count += repeats * batch
        best = min(best, (now - start) / count)
    return 1 / best


def main():
    """Prints the forward passes per second of this project and of ONNX Runtime, and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("weights", type=Path)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    for name, shape in NETWORKS.items():
        path = arguments.weights / f"{name}.onnx"
        network = session(path)
        for batch in (1, 8, 64, 256):
            rounds = []
            for _ in range(arguments.rounds):
                other = theirs(network, shape, batch)
                own = float(subprocess.run([OURS, path, str(batch)], check=True, stdout=subprocess.PIPE).stdout)
                rounds.append((own, other, own / other))
            own, other, ratio = (statistics.median(column) for column in zip(*rounds))
            print(f"{name}, batch {batch}: here {own:.0f}/s, ONNX Runtime {other:.0f}/s, ratio {ratio:.2f}", flush=True)


main()
