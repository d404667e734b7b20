"""Tests that the code of the page on training runs, from the root of the repository."""

from pathlib import Path

from page_blocks import blocks, run

ROOT = Path(__file__).resolve().parent.parent.parent


def test_the_page_runs():
    (code,) = [code for framework, code in blocks(ROOT / "docs" / "training.md") if framework == "baselines"]
    run(code, ROOT)
