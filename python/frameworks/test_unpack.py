"""Tests that packed observations are unpacked as Torch tensors."""

import numpy as np
import pogema_rs
import pytest
import torch
from pogema_rs import torch as for_torch
from pogema_rs.packed import words_per_agent


@pytest.mark.parametrize("radius", [*range(1, 17), 128])
def test_tensors_are_unpacked_on_their_device(radius):
    size = (2, 3, words_per_agent(radius))
    words = np.random.default_rng(radius).integers(2**32, size=size, dtype=np.uint32)
    expected = pogema_rs.unpack(words, radius)
    for device in ["cpu"] + ["cuda"] * torch.cuda.is_available():
        for tensor in (torch.from_numpy(words), torch.from_numpy(words.view(np.int32))):
            windows = pogema_rs.unpack(tensor.to(device), radius)
            assert windows.dtype == torch.float32 and windows.device.type == device
            np.testing.assert_array_equal(windows.cpu().numpy(), expected)
            assert torch.equal(for_torch.unpack(tensor.to(device), radius), windows)
        for dtype in ("uint8", torch.uint8):
            assert pogema_rs.unpack(tensor, radius, dtype=dtype).dtype == torch.uint8
        out = torch.full(windows.shape, 7, dtype=torch.bfloat16, device=device)
        assert pogema_rs.unpack(tensor.to(device), radius, out=out) is out
        np.testing.assert_array_equal(out.float().cpu().numpy(), expected)
    with pytest.raises(TypeError, match="expected type Tensor, like packed"):
        pogema_rs.unpack(tensor, radius, out=expected)
    with pytest.raises(TypeError, match="packed has type torch.float32, expected torch.uint32 or torch.int32"):
        pogema_rs.unpack(tensor.float(), radius)
    with pytest.raises(TypeError, match="packed has type ndarray, expected a torch tensor"):
        for_torch.unpack(words, radius)
