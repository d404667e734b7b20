"""Tests the mixers against the properties that their papers state, and the returns against plain loops."""

import itertools

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from pogema_rs.baselines import _iql, _qmix, _qplex, _targets, _vdn

AGENTS, ACTIONS, VALUES = 3, 5, 7
SEEDS = st.integers(0, 2**31)


def mixer(name, seed):
    torch.manual_seed(seed)
    made = {
        "iql": _iql.Independent,
        "vdn": lambda: _vdn.Sum(AGENTS),
        "qmix": lambda: _qmix.Monotone(VALUES, 8, AGENTS),
        "qplex": lambda: _qplex.Duplex(VALUES, 8, AGENTS, 4),
    }[name]()
    # Larger weights than those of a new mixer, so that its functions are not nearly linear.
    for parameter in made.parameters():
        torch.nn.init.normal_(parameter, std=0.7)
    return made.double()


def drawn(seed, *shape):
    generator = torch.Generator().manual_seed(seed)
    return torch.randn(*shape, generator=generator, dtype=torch.float64)


def joint_values(made, values, state):
    """Returns all joint actions, and the team's value of each of them in one state."""
    joint = torch.tensor(list(itertools.product(range(ACTIONS), repeat=AGENTS)))
    chosen = values.expand(len(joint), -1, -1).gather(-1, joint.unsqueeze(-1)).squeeze(-1)
    best = values.amax(dim=-1).expand(len(joint), -1)
    with torch.no_grad():
        return joint, made(chosen, best, joint, state.expand(len(joint), -1)).squeeze(-1)


@pytest.mark.parametrize("name", ["vdn", "qmix", "qplex"])
@settings(max_examples=60, deadline=None)
@given(seed=SEEDS)
def test_best_own_actions_are_a_best_joint_action(name, seed):
    values, state = 3 * drawn(seed, AGENTS, ACTIONS), drawn(seed + 1, VALUES)
    joint, mixed = joint_values(mixer(name, seed), values, state)
    own = (joint == values.argmax(dim=-1)).all(dim=-1)
    assert own.sum() == 1
    assert mixed[own] >= mixed.max() - 1e-9


@pytest.mark.parametrize("name", ["vdn", "qmix"])
@settings(max_examples=60, deadline=None)
@given(seed=SEEDS, agent=st.integers(0, AGENTS - 1))
def test_the_value_of_the_team_grows_with_that_of_each_agent(name, seed, agent):
    made, states = mixer(name, seed), drawn(seed, 16, VALUES)
    lower = drawn(seed + 1, 16, AGENTS)
    higher = lower.clone()
    higher[:, agent] += drawn(seed + 2, 16).abs()
    actions = torch.zeros(16, AGENTS, dtype=torch.long)
    with torch.no_grad():
        assert (made(higher, higher, actions, states) >= made(lower, lower, actions, states) - 1e-9).all()


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS)
def test_qplex_represents_functions_that_are_not_monotone(seed):
    # The weights of advantages depend on the joint action, so an agent's worse action can be better for the team.
    found = False
    for number in range(20):
        values, state = drawn(seed + number, AGENTS, ACTIONS), drawn(seed - number, VALUES)
        joint, mixed = joint_values(mixer("qplex", seed + number), values, state)
        order = values[0].argsort()
        for others in itertools.product(range(ACTIONS), repeat=AGENTS - 1):
            same = (joint[:, 1:] == torch.tensor(others)).all(dim=-1)
            found = found or bool((mixed[same][order].diff() < -1e-9).any())
    assert found


@settings(max_examples=40, deadline=None)
@given(seed=SEEDS)
def test_qplex_adds_values_for_the_best_joint_action_and_subtracts_for_others(seed):
    values, state = drawn(seed, AGENTS, ACTIONS), drawn(seed + 1, VALUES)
    made = mixer("qplex", seed)
    joint, mixed = joint_values(made, values, state)
    with torch.no_grad():
        weights = torch.nn.functional.softplus(made.weights(state)) + 1e-6
        expected = (weights * values.amax(dim=-1) + made.biases(state)).sum()
    own = (joint == values.argmax(dim=-1)).all(dim=-1)
    torch.testing.assert_close(mixed[own], expected.unsqueeze(0))
    assert (mixed[~own] < expected).all()


def test_the_mixers_have_gradients_for_every_agent():
    for name in ("iql", "vdn", "qmix", "qplex"):
        chosen, states = drawn(1, 4, AGENTS).requires_grad_(), drawn(2, 4, VALUES)
        best = chosen.detach() + 1
        mixer(name, 3)(chosen, best, torch.zeros(4, AGENTS, dtype=torch.long), states).sum().backward()
        assert (chosen.grad != 0).all(), name


def ends(seed, steps, lanes):
    """Returns rewards, values and ends of episodes of different lengths, some of which the time limit ends."""
    generator = torch.Generator().manual_seed(seed)
    lengths = torch.randint(1, steps + 1, (lanes,), generator=generator)
    played = torch.arange(steps).unsqueeze(-1) < lengths
    last = _targets.last_steps(played)
    terminated = last & (torch.rand(lanes, generator=generator) < 0.5)
    rewards = torch.randn(steps, lanes, generator=generator)
    values = torch.randn(steps + 1, lanes, generator=generator)
    return lengths, played, last, terminated, rewards, values


def close(found, expected):
    """Compares sums of float32 numbers that were added in different orders."""
    torch.testing.assert_close(found, torch.as_tensor(expected, dtype=torch.float32), rtol=1e-4, atol=1e-5)


@settings(max_examples=40, deadline=None)
@given(seed=SEEDS, discount=st.floats(0.1, 1), trace=st.floats(0, 1))
def test_lambda_returns_equal_a_plain_loop(seed, discount, trace):
    lengths, played, last, terminated, rewards, values = ends(seed, 9, 5)
    found = _targets.lambda_returns(discount, trace, values[1:], rewards, terminated, last)
    for lane, length in enumerate(lengths.tolist()):
        expected = values[length, lane] * (not terminated[length - 1, lane])
        for step in reversed(range(length)):
            next_value = values[step + 1, lane] * (not terminated[step, lane])
            mean = next_value if step == length - 1 else (1 - trace) * next_value + trace * expected
            expected = rewards[step, lane] + discount * mean
            close(found[step, lane], expected)


@settings(max_examples=40, deadline=None)
@given(seed=SEEDS, discount=st.floats(0.1, 1), trace=st.floats(0, 1))
def test_advantages_equal_a_plain_loop(seed, discount, trace):
    lengths, played, last, terminated, rewards, values = ends(seed, 9, 5)
    advantages, returns = _targets.estimate_advantages(discount, trace, values, rewards, terminated, last)
    for lane, length in enumerate(lengths.tolist()):
        for step in range(length):
            expected = 0.0
            for later in range(step, length):
                next_value = values[later + 1, lane] * (not terminated[later, lane])
                error = rewards[later, lane] + discount * next_value - values[later, lane]
                expected = expected + (discount * trace) ** (later - step) * error
            close(advantages[step, lane], expected)
            close(returns[step, lane], expected + values[step, lane])
