"""Tests that the code blocks of the guide that need a framework run."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

GUIDE = Path(__file__).resolve().parent.parent.parent / "docs" / "guide"
BLOCK = re.compile(r"^<!-- framework: (\w+) -->\n```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PAGES = ["python.md", "train_to_table.md"]
BLOCKS = {name: code for page in PAGES for name, code in BLOCK.findall((GUIDE / page).read_text())}


def test_guide_has_a_block_for_each_framework():
    assert set(BLOCKS) == {"pufferlib", "sample_factory", "tensorboard", "torch", "torchrl", "wandb"}


# Sample Factory is in a virtual environment of its own.
@pytest.mark.parametrize("framework", sorted(set(BLOCKS) - {"sample_factory"}))
def test_block_runs(framework, tmp_path):
    code = [sys.executable, "-B", "-c", BLOCKS[framework]]
    run = subprocess.run(code, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
