"""Tests that the Python blocks of the READMEs and of all pages in docs/ run: per page in order, in one process.

A comment assigns other blocks to a framework: `./check frameworks`, `./check jax` and `./check baselines` run those.
"""

from pathlib import Path

import pytest
from page_blocks import blocks, run

ROOT = Path(__file__).resolve().parent.parent.parent
FILES = [ROOT / "README.md", ROOT / "python" / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = [path for path in FILES if blocks(path)]


def test_pages_are_found():
    assert {path.name for path in PAGES} >= {"README.md", "python.md"}


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_blocks_run(page, tmp_path):
    run("\n".join(code for framework, code in blocks(page) if not framework), tmp_path)
