"""Tests that exported PyTorch modules return the logits of PyTorch, and that others are rejected."""

import copy
import json
from collections import OrderedDict

import numpy as np
import pytest
import torch
from pogema_rs import VecEnv
from pogema_rs.policies import Encoder, export, load
from torch import nn

WINDOWS = Encoder(3, ["obstacles", "agents"])
BOTH = Encoder(2, ["obstacles", "cost_to_go"], ["goal_direction", "position"])


class Residual(nn.Module):
    def __init__(self, *layers):
        super().__init__()
        self.residual = nn.Sequential(*layers)

    def forward(self, values):
        return values + self.residual(values)


class Network(nn.Module):
    """A network with scalars, a value, and an optional recurrent layer."""

    def __init__(self, has_gru):
        super().__init__()
        self.body = nn.Sequential(nn.Conv2d(2, 4, 3, padding="same", bias=False), nn.ELU(), nn.Flatten())
        self.scalars = nn.Sequential(nn.Linear(4, 6), nn.ReLU())
        self.core = nn.Sequential(nn.Linear(106, 16), nn.ReLU(), *([nn.GRU(16, 8)] if has_gru else []))
        self.policy, self.value = nn.Linear(8 if has_gru else 16, 5), nn.Linear(8 if has_gru else 16, 1)

    def forward(self, windows, scalars, state=None):
        features = torch.cat([self.body(windows), self.scalars(scalars)], dim=1)
        for layer in self.core:
            if isinstance(layer, nn.GRU):
                features, state = layer(features[None], state)
                features = features[0]
            else:
                features = layer(features)
        return self.policy(features), state


def sequential(in_place):
    block = Residual(nn.ReLU(inplace=in_place), nn.Conv2d(4, 4, 3, padding=1), nn.ReLU(), nn.Conv2d(4, 4, 3, padding=1))
    return nn.Sequential(
        nn.Conv2d(2, 4, 3, padding=1), block, nn.ReLU(), nn.Dropout(0.5), nn.Flatten(),
        nn.Sequential(nn.Linear(196, 8), nn.ELU()),
        nn.Linear(8, 5),
    )  # fmt: skip


def drawn(encoder, count=40):
    rng = np.random.default_rng(0)
    windows = rng.uniform(-1, 1, (count, *encoder.shape)).astype(np.float32)
    return windows, rng.uniform(-1, 1, (count, 2 * len(encoder.scalars))).astype(np.float32)


@pytest.mark.parametrize("in_place", [False, True])
@pytest.mark.parametrize("suffix", [".safetensors", ".onnx"])
def test_a_sequential_returns_the_logits_of_pytorch(in_place, suffix, tmp_path):
    torch.manual_seed(1)
    module, path, (windows, _) = sequential(in_place), tmp_path / f"network{suffix}", drawn(WINDOWS)
    module.train()
    module[1].eval()
    modes = [child.training for child in module.modules()]
    export(module, WINDOWS, path, sampling="greedy")
    assert [child.training for child in module.modules()] == modes
    module.eval()
    with torch.no_grad():
        expected = module(torch.from_numpy(windows.copy())).numpy()
    policy = load(path)
    assert policy.encoder == WINDOWS and policy.sampling == "greedy"
    np.testing.assert_allclose(policy.logits(windows), expected, rtol=1e-4, atol=1e-5)


class Recurrent(nn.Module):
    """A recurrent network in one of the forms that people write."""

    def __init__(self, form):
        super().__init__()
        self.form = form
        self.body = nn.Sequential(nn.Conv2d(2, 4, 3, padding=1), nn.ReLU())
        self.features = nn.Linear(196, 16)
        self.core = nn.GRU(16, 8, batch_first=form.startswith("batch first"))
        self.first, self.policy = nn.Parameter(torch.randn(1, 1, 8)), nn.Linear(8, 5)

    def forward(self, windows, state=None):
        values = self.body(windows)
        values = torch.relu(self.features(values.view(values.size(0), -1)))
        if self.form == "all agents are one sequence":
            return self.policy(self.core(values)[0])
        if self.form == "a learned initial state":
            state = self.first.expand(1, len(values), 8).contiguous()
        if self.form == "zeros as the initial state":
            state = torch.zeros(1, len(values), 8)
        if self.form == "a state without time":
            state = state[None]
        steps, state = self.core(values.unsqueeze(1 if self.core.batch_first else 0), state)
        features = {
            "the state": lambda: state[0],
            "the state without its axis": lambda: state.squeeze(0),
            "the last step": lambda: steps[-1],
            "batch first": lambda: steps.squeeze(1),
            "batch first, the last step": lambda: steps[:, -1],
            "flattened": lambda: torch.flatten(steps, 0, 1),
            "viewed": lambda: steps.view(-1, 8),
        }.get(self.form, lambda: steps.squeeze(0))()
        return self.policy(features)


RECURRENT = {
    "the state": 3,
    "the state without its axis": 3,
    "the last step": 3,
    "batch first": 3,
    "batch first, the last step": 3,
    "flattened": None,
    "viewed": None,
    "zeros as the initial state": None,
    "a state without time": 2,
    "all agents are one sequence": None,
    "a learned initial state": None,
}


@pytest.mark.parametrize("form", RECURRENT)
@pytest.mark.parametrize("dynamo", [False, True])
@pytest.mark.parametrize("batch", [None, 1, 4])
def test_recurrent_graphs_of_pytorch_return_its_logits(form, dynamo, batch, tmp_path):
    torch.manual_seed(2)
    module, path, (windows, _) = Recurrent(form).eval(), tmp_path / "network.onnx", drawn(WINDOWS)
    windows = torch.from_numpy(windows)
    num = batch or 3
    state = {None: None, 2: torch.zeros(num, 8), 3: torch.zeros(1, num, 8)}[RECURRENT[form]]
    sample, names = (windows[:num],), ["windows"]
    if state is not None:
        sample, names = (*sample, state), [*names, "state"]
    open_sizes = {}
    if batch is None and dynamo:
        size = torch.export.Dim("batch")
        axes = {"windows": {0: size}, "state": {state.dim() - 2: size} if state is not None else None}
        open_sizes = {"dynamic_shapes": {name: axes[name] for name in names}}
    elif batch is None:
        axes = {"windows": {0: "batch"}, "state": {state.dim() - 2: "batch"} if state is not None else None}
        open_sizes = {"dynamic_axes": {name: axes[name] for name in names}}
    torch.onnx.export(
        module, sample, path, dynamo=dynamo, input_names=names, output_names=["logits"], **open_sizes,
        **({"external_data": False, "verbose": False} if dynamo else {}),
    )  # fmt: skip
    rule = {"rule": "greedy", "mask_actions": False}
    path.with_suffix(".json").write_text(json.dumps({"version": 1, "encoder": WINDOWS.to_dict(), "sampling": rule}))
    wrong = {
        "all agents are one sequence": "shape (1, batch, features)",
        "a learned initial state": "initial state is neither",
    }
    # A graph for one agent has a sequence of one step.
    if form in wrong and not (form == "all agents are one sequence" and batch == 1):
        with pytest.raises(ValueError, match=f"operator `GRU` whose .*{wrong[form]}"):
            load(path)
        return
    with torch.no_grad():
        expected = torch.cat([module(windows[at : at + num], state) for at in range(0, len(windows) - num, num)])
    np.testing.assert_allclose(load(path).logits(windows[: len(expected)]), expected.numpy(), rtol=1e-4, atol=1e-5)


def shared_activation():
    relu = nn.ReLU()
    return nn.Sequential(nn.Conv2d(2, 4, 3), relu, nn.Conv2d(4, 4, 3), relu, nn.Flatten(), nn.Linear(36, 5))


def named():
    layers = {"2": nn.Flatten(), "1": nn.Linear(98, 8), "relu": nn.ReLU(), "out": nn.Linear(8, 5)}
    return nn.Sequential(OrderedDict(layers))


def with_block(*layers):
    return nn.Sequential(nn.Conv2d(2, 2, 3, padding=1), Residual(*layers), nn.Flatten(), nn.Linear(98, 5))


class Parts(nn.Module):
    """A module with `body` and `policy`; its `forward` agrees with them only if `factor` is 1."""

    def __init__(self, factor=1):
        super().__init__()
        self.body, self.policy, self.factor = nn.Sequential(nn.Flatten()), nn.Linear(98, 5), factor

    def forward(self, windows):
        return self.policy(self.factor * self.body(windows)), None


class NoLogits(Parts):
    def forward(self, windows):
        return self.body(windows)


@pytest.mark.parametrize(
    "module",
    [
        shared_activation(),
        named(),
        with_block(nn.Dropout(inplace=True)),
        with_block(nn.Dropout(inplace=True), nn.Conv2d(2, 2, 3, padding=1)),
        with_block(nn.Identity(), nn.ReLU(inplace=True), nn.Conv2d(2, 2, 3, padding=1)),
        with_block(nn.Sequential(nn.ReLU(inplace=True)), nn.Conv2d(2, 2, 3, padding=1)),
        with_block(Residual(nn.ReLU(inplace=True), nn.Conv2d(2, 2, 3, padding=1))),
        shared_activation().bfloat16(),
        Parts().half(),
        NoLogits(),
    ],
)
def test_modules_return_the_logits_of_pytorch(module, tmp_path):
    path, (windows, _) = tmp_path / "network.safetensors", drawn(WINDOWS)
    export(module, WINDOWS, path)
    whole = copy.deepcopy(module).float().eval()
    with torch.no_grad():
        outputs = (
            whole.policy(whole.body(torch.from_numpy(windows)))
            if hasattr(whole, "body")
            else whole(torch.from_numpy(windows.copy()))
        )
    np.testing.assert_allclose(load(path).logits(windows), outputs.numpy(), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("has_gru", [False, True])
def test_a_module_with_scalars_and_a_value_returns_the_logits_of_pytorch(has_gru, tmp_path):
    torch.manual_seed(2)
    module, path, (windows, scalars) = Network(has_gru), tmp_path / "network.safetensors", drawn(BOTH)
    export(module, BOTH, path)
    architecture = json.loads(path.with_suffix(".json").read_text())["architecture"]
    assert architecture["value"] == "value"
    with torch.no_grad():
        expected, _ = module(torch.from_numpy(windows), torch.from_numpy(scalars))
    np.testing.assert_allclose(load(path).logits(windows, scalars), expected.numpy(), rtol=1e-4, atol=1e-5)


def test_a_recurrent_module_plays_as_in_pytorch(tmp_path):
    torch.manual_seed(3)
    module, path = Network(has_gru=True), tmp_path / "network.safetensors"
    export(module, BOTH, path, sampling="greedy")
    policy = load(path)
    config = {"num_agents": 6, "size": 10, "on_target": "restart", "max_episode_steps": 8, "seed": 1}
    envs = VecEnv(config, 3, encoder=BOTH)
    observations, _ = envs.reset(seed=1)
    state, num_clear = torch.zeros(1, 18, 8), 0
    for step in range(24):
        windows = torch.from_numpy(observations["windows"].copy()).flatten(0, 1)
        with torch.no_grad():
            logits, state = module(windows, torch.from_numpy(observations["scalars"].copy()).flatten(0, 1), state)
        actions, ordered = policy.act(envs), logits.sort(dim=1).values
        is_clear = (ordered[:, -1] - ordered[:, -2] > 1e-4).numpy()
        np.testing.assert_array_equal(actions.reshape(-1)[is_clear], logits.argmax(dim=1).numpy()[is_clear])
        num_clear += is_clear.sum()
        observations, *_ = envs.step(actions)
        if step % 8 == 7:
            state.zero_()
    assert num_clear > 300


class Scaled(Residual):
    def forward(self, values):
        return values + 0.5 * self.residual(values)


class OwnForward(nn.Sequential):
    def forward(self, values):
        return super().forward(values / 2)


def with_layer(layer):
    return nn.Sequential(layer, nn.Flatten(), nn.LazyLinear(5))


@pytest.mark.parametrize(
    ("module", "error", "text"),
    [
        (with_layer(nn.MaxPool2d(2)), TypeError, "layer `0` cannot be exported: MaxPool2d"),
        (
            with_layer(nn.Sequential(nn.ReLU(), nn.BatchNorm2d(2))),
            TypeError,
            "layer `0.1` cannot be exported: BatchNorm2d",
        ),
        (with_layer(nn.Conv2d(2, 2, 3, stride=2)), TypeError, "layer `0` cannot be exported: Conv2d"),
        (with_layer(nn.Conv2d(2, 2, (3, 1), padding=(1, 0))), TypeError, "layer `0` cannot be exported: Conv2d"),
        (with_layer(nn.ELU(alpha=2)), TypeError, "layer `0` cannot be exported: ELU"),
        (
            nn.Sequential(nn.Flatten(), nn.GRU(98, 4, num_layers=2), nn.Linear(4, 5)),
            TypeError,
            "layer `1` cannot be exported: GRU",
        ),
        (nn.Sequential(nn.Linear(2, 5), nn.ReLU()), TypeError, "`1` has type ReLU, expected an nn.Linear"),
        (nn.Sequential(), TypeError, "empty nn.Sequential"),
        (
            nn.Linear(2, 5),
            TypeError,
            "module has type Linear, expected an nn.Sequential, or a module with `body` and `policy`",
        ),
        (3, TypeError, "module has type int"),
        (nn.Sequential(nn.Flatten(), nn.Linear(98, 4)), ValueError, "the network has 4 logits, expected 5"),
        (nn.Sequential(nn.Flatten(), nn.Linear(50, 5)), ValueError, "tensor `1.weight` has shape"),
        (nn.Sequential(nn.Linear(7, 5)), ValueError, "expected `flatten`"),
        (
            nn.Sequential(Scaled(nn.ReLU()), nn.Flatten(), nn.Linear(98, 5)),
            ValueError,
            "differs from the module: logits differ by up to",
        ),
        (
            OwnForward(nn.Flatten(), nn.Linear(98, 5)),
            TypeError,
            "module has type OwnForward, expected an nn.Sequential",
        ),
        (with_layer(OwnForward(nn.ReLU())), TypeError, "layer `0` cannot be exported: OwnForward"),
        (Parts(0.5), ValueError, "the module's `forward` differs from its layers .*: logits differ by"),
    ],
)
def test_other_modules_are_rejected(module, error, text, tmp_path):
    with pytest.raises(error, match=text) as caught:
        export(module, WINDOWS, tmp_path / "network.safetensors")
    assert "\n" not in str(caught.value) and not list(tmp_path.iterdir())


def test_parameters_that_are_not_finite_are_rejected(tmp_path):
    module = nn.Sequential(nn.Flatten(), nn.Linear(98, 5))
    with torch.no_grad():
        module[1].bias[2] = float("nan")
    with pytest.raises(ValueError, match="tensor `1.bias`: value 2 is `NaN`"):
        export(module, WINDOWS, tmp_path / "network.safetensors")
