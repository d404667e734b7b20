"""A plain model of networks in NumPy, and networks with random weights."""

import numpy as np


class Drawn:
    """Returns descriptions of layers, and collects random weights for them in `tensors`."""

    def __init__(self, seed):
        self.rng, self.tensors = np.random.default_rng(seed), {}

    def add(self, name, *shape):
        self.tensors[name] = self.rng.normal(0, 0.5, shape).astype(np.float32)

    def convolution(self, name, outputs, inputs, side=3, padding=1):
        self.add(f"{name}.weight", outputs, inputs, side, side)
        self.add(f"{name}.bias", outputs)
        return {"convolution": {"name": name, "padding": padding}}

    def dense(self, name, outputs, inputs):
        self.add(f"{name}.weight", outputs, inputs)
        self.add(f"{name}.bias", outputs)
        return {"dense": name}

    def gru(self, name, size, inputs):
        for kind, length in (("ih", inputs), ("hh", size)):
            self.add(f"{name}.weight_{kind}_l0", 3 * size, length)
            self.add(f"{name}.bias_{kind}_l0", 3 * size)
        return {"gru": name}


def sigmoid(values):
    return 1 / (1 + np.exp(-values))


class PlainNetwork:
    """Runs the layers of a network one by one, in double precision. `state` holds one row per agent."""

    def __init__(self, layers, tensors, actions="policy"):
        self.layers, self.actions = layers, actions
        self.tensors = {name: tensor.astype(np.float64) for name, tensor in tensors.items()}

    def logits(self, windows, scalars=None, state=None):
        """Returns the logits, and changes the state."""
        self.numbers, self.state = scalars, state
        features = self.run(self.layers, windows.astype(np.float64))
        return self.dense(self.actions, features)

    def run(self, layers, values):
        for layer in layers:
            kind, about = next(iter(layer.items())) if isinstance(layer, dict) else (layer, None)
            values = getattr(self, kind)(about, values)
        return values

    def convolution(self, about, values):
        weight, bias = self.tensors[f"{about['name']}.weight"], self.tensors[f"{about['name']}.bias"]
        padding = about["padding"]
        padded = np.pad(values, ((0, 0), (0, 0), (padding, padding), (padding, padding)))
        shape = weight.shape[2:]
        windows = np.lib.stride_tricks.sliding_window_view(padded, shape, axis=(2, 3))
        return np.einsum("bcijxy,ocxy->boij", windows, weight) + bias[:, None, None]

    def dense(self, name, values):
        return values @ self.tensors[f"{name}.weight"].T + self.tensors[f"{name}.bias"]

    def relu(self, _, values):
        return np.maximum(values, 0)

    def elu(self, _, values):
        return np.where(values > 0, values, np.expm1(np.minimum(values, 0)))

    def flatten(self, _, values):
        return values.reshape(len(values), -1)

    def residual(self, layers, values):
        return values + self.run(layers, values)

    def scalars(self, layers, values):
        return np.concatenate([values, self.run(layers, self.numbers.astype(np.float64))], axis=1)

    def gru(self, name, values):
        size = self.tensors[f"{name}.weight_hh_l0"].shape[1]
        old = np.zeros((len(values), size)) if self.state is None else self.state
        of_input = np.split(values @ self.tensors[f"{name}.weight_ih_l0"].T + self.tensors[f"{name}.bias_ih_l0"], 3, 1)
        of_state = np.split(old @ self.tensors[f"{name}.weight_hh_l0"].T + self.tensors[f"{name}.bias_hh_l0"], 3, 1)
        reset, update = (sigmoid(of_input[gate] + of_state[gate]) for gate in range(2))
        new = np.tanh(of_input[2] + reset * of_state[2])
        now = (1 - update) * new + update * old
        if self.state is not None:
            self.state[:] = now
        return now


def drawn_network(seed, channels, radius, num_scalars, has_gru=True):
    """Returns layers of every kind and their random weights; the scalars and the GRU are optional."""
    drawn, side = Drawn(seed), 2 * radius + 1
    flat, beside = 3 * side * side, 4 if num_scalars else 0
    layers = [
        drawn.convolution("stem", 3, channels),
        "relu",
        {"residual": [drawn.convolution("block.0", 3, 3), "elu", drawn.convolution("block.1", 3, 3)]},
        "relu",
        "flatten",
    ]
    if num_scalars:
        layers.append({"scalars": [drawn.dense("numbers", beside, num_scalars), "elu"]})
    layers += [drawn.dense("core", 6, flat + beside), "relu"]
    if has_gru:
        layers.append(drawn.gru("memory", 4, 6))
    drawn.dense("policy", 5, 4 if has_gru else 6)
    return layers, drawn.tensors
