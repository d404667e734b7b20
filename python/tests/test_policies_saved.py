"""Tests that saved networks return the same logits as a model in NumPy, and that wrong networks are rejected."""

import json
import subprocess
import sys

import numpy as np
import pytest
from network_model import Drawn, PlainNetwork, drawn_network
from pogema_rs.policies import Encoder, export, load, save

ENCODER = Encoder(2, ["obstacles", "agents"], ["goal_offset"])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("num_scalars", [0, 2])
@pytest.mark.parametrize("has_gru", [False, True])
def test_saved_networks_return_the_logits_of_the_numpy_model(seed, num_scalars, has_gru, tmp_path):
    layers, tensors = drawn_network(seed, 2, 2, num_scalars, has_gru)
    encoder = ENCODER if num_scalars else Encoder(2, ["obstacles", "agents"])
    path = tmp_path / "network.safetensors"
    save(path, encoder, layers, tensors)
    rng = np.random.default_rng(seed)
    windows = rng.uniform(-1, 1, (33, 2, 5, 5)).astype(np.float32)
    scalars = rng.uniform(-1, 1, (33, 2)).astype(np.float32) if num_scalars else None
    policy = load(path)
    assert policy.encoder == encoder and policy.sampling == "softmax"
    expected = PlainNetwork(layers, tensors).logits(windows, scalars)
    np.testing.assert_allclose(policy.logits(windows, scalars), expected, rtol=1e-4, atol=1e-5)


def test_the_value_is_saved_beside_the_logits(tmp_path):
    drawn = Drawn(0)
    drawn.dense("actor", 5, 50)
    drawn.dense("critic", 1, 50)
    path = tmp_path / "network.safetensors"
    save(
        path,
        Encoder(2, ["obstacles", "agents"]),
        ["flatten"],
        drawn.tensors,
        actions="actor",
        value="critic",
        sampling="greedy",
    )
    architecture = json.loads(path.with_suffix(".json").read_text())["architecture"]
    assert (architecture["actions"], architecture["value"]) == ("actor", "critic")
    assert load(path).sampling == "greedy" and load(path, sampling="softmax").sampling == "softmax"


def changed(tensors, **changes):
    return {**tensors, **{name.replace("__", "."): value for name, value in changes.items()}}


def test_wrong_networks_are_rejected_and_change_no_file(tmp_path):
    encoder = Encoder(2, ["obstacles", "agents"])
    layers, tensors = drawn_network(0, 2, 2, 0)
    path = tmp_path / "network.safetensors"
    save(path, encoder, layers, tensors)
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    infinite = np.full(5, np.inf, np.float32)
    wrong = [
        ((encoder, layers, changed(tensors, core__bias=np.zeros(7))), {}, "tensor `core.bias` has shape"),
        ((encoder, layers, changed(tensors, policy__bias=infinite)), {}, "tensor `policy.bias`: value 0 is `inf`"),
        ((encoder, layers, changed(tensors, more=np.zeros(3))), {}, "tensor `more` belongs to no layer"),
        ((encoder, layers[:1], tensors), {}, "the layers end with a window, expected `flatten`"),
        ((encoder, ["pool", *layers], tensors), {}, "unknown variant `pool`"),
        ((Encoder(3, ["obstacles", "agents"]), layers, tensors), {}, "tensor `core.weight`"),
        ((Encoder(2, ["obstacles"]), layers, tensors), {}, "tensor `stem.weight`"),
        ((ENCODER, layers, tensors), {}, "layers ignore the scalars of the encoder"),
        ((encoder, layers, tensors), {"actions": "stem"}, "tensor `stem.weight`"),
        ((encoder, layers, tensors), {"sampling": "best"}, "sampling is 'best', expected one of 'softmax'"),
    ]
    for arguments, settings, text in wrong:
        with pytest.raises(ValueError, match=text) as caught:
            save(path, *arguments, **settings)
        assert "\n" not in str(caught.value)
    with pytest.raises(ValueError, match="expected the name of a file that ends in .safetensors"):
        save(tmp_path / "network.pt", encoder, layers, tensors)
    with pytest.raises(OSError, match="nowhere"):
        save(tmp_path / "nowhere" / "network.safetensors", encoder, layers, tensors)
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


def test_export_without_pytorch_says_so(tmp_path):
    with pytest.raises(ModuleNotFoundError, match="torch"):
        export(object(), ENCODER, tmp_path / "network.safetensors")
    for name in ("network.pt", "network"):
        with pytest.raises(ValueError, match="expected the name of a file that ends in"):
            export(object(), ENCODER, tmp_path / name)


def test_importing_the_package_does_not_import_pytorch():
    code = "import sys, pogema_rs, pogema_rs.policies, pogema_rs.vec_env; assert 'torch' not in sys.modules"
    assert subprocess.run([sys.executable, "-B", "-c", code], check=False).returncode == 0
