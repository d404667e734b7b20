"""Tests that the code of the page on training runs, from the root of the repository."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
BLOCK = re.compile(r"^<!-- framework: baselines -->\n```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_the_page_runs():
    (code,) = BLOCK.findall((ROOT / "docs" / "training.md").read_text(encoding="utf-8"))
    run = subprocess.run([sys.executable, "-B", "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
