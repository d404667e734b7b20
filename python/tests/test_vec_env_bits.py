"""Tests packed observations of `VecEnv` against its windows of float32."""

import numpy as np
import pogema_rs
import pytest
from pogema_rs.packed import words_per_agent
from pogema_rs.vec_env import VecEnv
from vec_helpers import CONFIG

RADII = [*range(1, 17), 32, 128]


def random_words(radius, *shape):
    rng = np.random.default_rng(radius)
    return rng.integers(2**32, size=(*shape, words_per_agent(radius)), dtype=np.uint32)


@pytest.mark.parametrize("radius", RADII)
@pytest.mark.parametrize("double_buffer", [False, True])
def test_bits_equal_windows_at_every_radius(radius, double_buffer):
    config = {**CONFIG, "obs_radius": radius, "max_episode_steps": 3}
    plain = VecEnv(config, 3)
    packed = VecEnv(config, 3, dtype="bits", double_buffer=double_buffer)
    assert packed.single_observation_space.shape == (5, words_per_agent(radius))
    windows, _ = plain.reset(seed=radius)
    words, _ = packed.reset(seed=radius)
    num_ends = 0
    for step in range(8):
        assert words.dtype == np.uint32 and packed.observation_space.contains(words)
        seen = pogema_rs.unpack(words, radius)
        assert seen.dtype == np.float32
        np.testing.assert_array_equal(seen, windows)
        before, kept = words, words.copy()
        actions = plain.sample_actions()
        windows, *_, infos = plain.step(actions)
        out = np.full_like(kept, 2**32 - 1) if step % 2 else None
        words, *_, others = packed.step(actions, out=out)
        assert words is out or out is None
        if double_buffer or out is not None:
            np.testing.assert_array_equal(before, kept)
        assert ("final_obs" in infos) == ("final_obs" in others)
        for env in np.flatnonzero(infos.get("_final_obs", [])):
            final = pogema_rs.unpack(others["final_obs"][env], radius)
            np.testing.assert_array_equal(final, infos["final_obs"][env])
            num_ends += 1
    assert num_ends == 6


def test_an_agent_takes_48_bytes_at_radius_5():
    words, _ = VecEnv({**CONFIG, "obs_radius": 5}, 2, dtype="bits").reset(seed=0)
    assert words.nbytes == 2 * 5 * 48


@pytest.mark.parametrize("radius", RADII)
def test_unpacked_bits_follow_the_documented_order(radius):
    words = random_words(radius, 2, 3)
    side = 2 * radius + 1
    windows = pogema_rs.unpack(words, radius, dtype="uint8")
    assert windows.dtype == np.uint8 and windows.shape == (2, 3, 3, side, side)
    for cell in np.random.default_rng(1).integers(3 * side * side, size=20):
        bit = words[1, 2, cell // 32] >> np.uint32(cell % 32) & 1
        assert windows[1, 2].reshape(-1)[cell] == bit
    for out in (np.full(windows.shape, 7, np.float64), np.full(windows.shape, True)):
        assert pogema_rs.unpack(words, radius, out=out) is out
        np.testing.assert_array_equal(out, windows)
    np.testing.assert_array_equal(pogema_rs.unpack(words[:, ::2], radius), windows[:, ::2])


GOOD = np.zeros((2, 12), np.uint32)
BAD = [
    (([0] * 12, 5), TypeError, "packed has type list, expected a numpy array of uint32 or a torch tensor"),
    ((GOOD.astype(np.int64), 5), TypeError, "packed has type int64, expected uint32"),
    ((GOOD.astype(">u4"), 5), TypeError, "packed has type >u4, expected uint32"),
    ((GOOD[:, :11], 5), ValueError, "packed has shape (2, 11), expected (..., 12) at radius 5"),
    ((GOOD, 4), ValueError, "packed has shape (2, 12), expected (..., 8) at radius 4"),
    ((np.array(3, np.uint32), 5), ValueError, "packed has shape (), expected (..., 12)"),
    ((GOOD, 0), ValueError, "radius is 0, expected 1 to 128"),
    ((GOOD, 5.0), TypeError, "radius is 5.0, expected a whole number"),
    ((GOOD, 5, None, [0]), TypeError, "out has type list, expected type ndarray, like packed"),
    ((GOOD, 5, None, np.zeros((2, 363))), ValueError, "out has shape (2, 363), expected (2, 3, 11, 11)"),
    ((GOOD, 5, "uint8", np.zeros((2, 3, 11, 11))), TypeError, "dtype and out are both given"),
]


@pytest.mark.parametrize(("arguments", "error", "text"), BAD)
def test_wrong_packed_observations_raise(arguments, error, text):
    with pytest.raises(error) as raised:
        pogema_rs.unpack(*arguments)
    assert text in str(raised.value) and "\n" not in str(raised.value)


def test_buffers_of_words_are_checked():
    env = VecEnv(CONFIG, 2, dtype="bits")
    words, _ = env.reset(seed=0)
    kept = words.copy()
    memory = np.zeros(words.nbytes + 8, np.uint8)
    wrong = [
        (memory[4:-4].view(np.uint32).reshape(words.shape), ValueError, "not aligned"),
        (np.zeros(words.shape, np.int32), TypeError, "out has type int32, expected uint32"),
        (np.zeros(words.shape, np.uint64), TypeError, "out has type uint64, expected uint32"),
        (np.zeros((2, 2, *words.shape[1:]), np.uint32)[:, 0], ValueError, "expected a C-contiguous array"),
    ]
    for out, error, text in wrong:
        with pytest.raises(error, match=text):
            env.reset(seed=0, out=out)
    assert (words == kept).all()
