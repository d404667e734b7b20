"""Tests that the code of the guide runs."""

import re
import subprocess
import sys
from pathlib import Path

PAGE = Path(__file__).resolve().parent.parent.parent / "docs" / "guide" / "jax.md"
BLOCK = re.compile(r"^<!-- framework: jax -->\n```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)

SHAPES = "(32, 8, 3, 11, 11) (32, 8)"


def test_the_guide_runs():
    printed = []
    for code in BLOCK.findall(PAGE.read_text(encoding="utf-8")):
        run = subprocess.run([sys.executable, "-B", "-c", code], capture_output=True, text=True, check=False)
        assert run.returncode == 0, run.stderr
        printed.append(run.stdout)
    assert re.fullmatch(r"0\.\d\d goals per step\n", printed[0])
    # JaxMARL prints lines of its own when it is imported.
    assert [text.splitlines()[-1] for text in printed[1:]] == ["(3, 11, 11) False", "1 parts", SHAPES]
