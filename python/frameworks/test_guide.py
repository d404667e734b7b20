"""Tests that the code blocks of the guide that need a framework run."""

from pathlib import Path

import pytest
from page_blocks import blocks, run

GUIDE = Path(__file__).resolve().parent.parent.parent / "docs" / "guide"
PAGES = ["python.md", "train_to_table.md"]
BLOCKS = {framework: code for page in PAGES for framework, code in blocks(GUIDE / page) if framework}


def test_guide_has_a_block_for_each_framework():
    assert set(BLOCKS) == {"pufferlib", "sample_factory", "tensorboard", "torch", "torchrl", "wandb"}


# Sample Factory is in a virtual environment of its own.
@pytest.mark.parametrize("framework", sorted(set(BLOCKS) - {"sample_factory"}))
def test_block_runs(framework, tmp_path):
    run(BLOCKS[framework], tmp_path)
