"""Runs the commands of the given Markdown files.

Bash runs every ```sh block in the root of the repository, and each must succeed. A ```text block directly below a line
`<!-- output: COMMAND -->` must equal the output of the command; if BLESS is set, the block is rewritten instead. Lines
that begin with `./check` are skipped, because `./check` runs this script.
"""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

# The folder of the program `pogema` that `./check` has built.
BUILT = Path(os.environ.get("CARGO_TARGET_DIR", "target")).resolve() / "checked"
BLOCK = re.compile(r"^```sh\n(.*?)^```$", re.MULTILINE | re.DOTALL)
OUTPUT = re.compile(r"(^<!-- output: (.*?) -->\n```text\n)(.*?)(^```$)", re.MULTILINE | re.DOTALL)


def in_profile(script: str) -> str:
    """Returns the script with release builds replaced with those of `./check`; this saves minutes of compilation."""
    script = (
        script.replace("cargo run --release -- ", "pogema ")
        .replace(" --release", " --profile checked")
        .replace("target/release/", "target/checked/")
    )
    # A single package enables fewer features of its dependencies, so building it alone would compile them again.
    script = re.sub(r"^(cargo .*?) -p [\w-]+( --all-features)?", r"\1", script, flags=re.MULTILINE)
    return re.sub(r"^cargo build (?!.*--profile)", "cargo build --profile checked ", script, flags=re.MULTILINE)


def run(script: str, place: str) -> str:
    """Returns the output of a script. If the script fails, ends the program with the place of the script."""
    script = in_profile(script)
    env = {**os.environ, "PATH": f"{BUILT}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(["bash", "-euo", "pipefail", "-c", script], stdout=subprocess.PIPE, text=True, env=env)
    if done.returncode != 0:
        sys.exit(f"{place}: exit status {done.returncode} from\n{script}{done.stdout}")
    return done.stdout


def check(path: Path) -> list[str]:
    """Runs all commands of one file in their order and returns the errors in its outputs."""
    text = path.read_text()
    expected = ""
    end = 0
    for found in sorted([*BLOCK.finditer(text), *OUTPUT.finditer(text)], key=lambda found: found.start()):
        place = f"{path}:{text.count(chr(10), 0, found.start()) + 1}"
        if found.re is BLOCK:
            script = "".join(line for line in found[1].splitlines(True) if not line.startswith("./check"))
            began = time.monotonic()
            run(script, place)
            first = script.splitlines()[0] if script else "nothing to run"
            print(f"{path}: {first} ({time.monotonic() - began:.0f} s)", flush=True)
        else:
            expected += text[end : found.start()] + found[1] + run(found[2], place).rstrip() + "\n" + found[4]
            end = found.end()
    expected += text[end:]
    if expected == text:
        return []
    if os.environ.get("BLESS"):
        path.write_text(expected)
        return []
    return [f"{path}: a quoted output differs from that of its command; run `BLESS=1 ./check docs` to update it"]


if __name__ == "__main__":
    errors = [message for name in sys.argv[1:] for message in check(Path(name))]
    sys.exit("\n".join(errors) if errors else 0)
