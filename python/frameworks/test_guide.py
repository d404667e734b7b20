"""Runs the code blocks of the guide and of the tutorial that need a framework."""

import subprocess
import sys
from pathlib import Path

import pytest
from page_blocks import blocks, run

ROOT = Path(__file__).resolve().parent.parent.parent
GUIDE = ROOT / "docs" / "guide"
TUTORIAL = ROOT / "docs" / "tutorials" / "train.md"
PAGES = ["python.md", "train_to_table.md"]
BLOCKS = {framework: code for page in PAGES for framework, code in blocks(GUIDE / page) if framework}


def test_guide_has_a_block_for_each_framework():
    assert set(BLOCKS) == {"pufferlib", "sample_factory", "tensorboard", "torch", "torchrl", "wandb"}


# Sample Factory is in a virtual environment of its own.
@pytest.mark.parametrize("framework", sorted(set(BLOCKS) - {"sample_factory"}))
def test_block_runs(framework, tmp_path):
    run(BLOCKS[framework], tmp_path)


def test_the_tutorial_plays_the_weights_that_it_trained(tmp_path):
    (tmp_path / "target").mkdir()
    (tmp_path / "python").symlink_to(ROOT / "python")
    script = [sys.executable, "-B", "python/examples/train_ppo.py", "--minutes", "0.05", "--save", "target/policy.pt"]
    subprocess.run(script, cwd=tmp_path, check=True, capture_output=True)
    pages = blocks(TUTORIAL)
    (policy,) = [code for framework, code in pages if framework == "policy"]
    (suite,) = [code for framework, code in pages if not framework and "ToolboxRegistry" in code]
    begin, end = suite.index("class Mine"), suite.index("suite = {")
    run(f"{policy}\n{suite[:begin]}{suite[end:]}", tmp_path)
