"""The Python blocks of Markdown pages, and how tests run them."""

import re
import subprocess
import sys

BLOCK = re.compile(r"^(?:<!-- framework: (\w+) -->\n)?```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page):
    """Returns the blocks of a page as pairs of a framework and code; the framework of blocks without one is ""."""
    return BLOCK.findall(page.read_text(encoding="utf-8"))


def run(code, folder):
    """Runs code in a new process and returns what it prints; raises an AssertionError if the code fails."""
    done = subprocess.run([sys.executable, "-B", "-c", code], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout
