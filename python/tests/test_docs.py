"""Tests that the Python blocks of the READMEs and the guide run: per page in order, in one process.

`./check frameworks` runs the blocks that a comment assigns to a framework.
"""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
BLOCK = re.compile(r"^(<!-- framework: \w+ -->\n)?```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILES = [ROOT / "README.md", ROOT / "python" / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = [path for path in FILES if BLOCK.search(path.read_text())]


def test_pages_are_found():
    assert {path.name for path in PAGES} >= {"README.md", "python.md"}


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_blocks_run(page, tmp_path):
    code = "\n".join(block for framework, block in BLOCK.findall(page.read_text()) if not framework)
    run = subprocess.run([sys.executable, "-B", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
