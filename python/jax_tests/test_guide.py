"""Tests that the code of the guide runs."""

import re
from pathlib import Path

from page_blocks import blocks, run

PAGE = Path(__file__).resolve().parent.parent.parent / "docs" / "guide" / "jax.md"

SHAPES = "(32, 8, 3, 11, 11) (32, 8)"


def test_the_guide_runs(tmp_path):
    printed = [run(code, tmp_path) for framework, code in blocks(PAGE) if framework == "jax"]
    assert re.fullmatch(r"0\.\d\d goals per step\n", printed[0])
    # JaxMARL prints lines of its own when it is imported.
    assert [text.splitlines()[-1] for text in printed[1:]] == ["(363,) False", "1 parts", SHAPES]
