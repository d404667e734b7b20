"""Runs what the given Markdown files tell their readers to run.

Every ```sh block is run by bash in the root of the repository and must succeed. A fenced block below a line
`<!-- output: COMMAND -->` must be what the command prints; with BLESS set it is written instead. `./check` itself is
left out, since it is what runs this.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

BLOCK = re.compile(r"^```sh\n(.*?)^```$", re.MULTILINE | re.DOTALL)
OUTPUT = re.compile(r"(^<!-- output: (.*?) -->\n```text\n)(.*?)(^```$)", re.MULTILINE | re.DOTALL)


def in_profile(script: str) -> str:
    """The script with what the checks have built in the place of release builds, which would take minutes more."""
    script = script.replace(" --release", " --profile checked").replace("target/release/", "target/checked/")
    # One package alone asks for fewer features of what it depends on, and would be built anew with them.
    script = re.sub(r"^(cargo .*?) -p [\w-]+( --all-features)?", r"\1", script, flags=re.MULTILINE)
    return re.sub(r"^cargo build (?!.*--profile)", "cargo build --profile checked ", script, flags=re.MULTILINE)


def run(script: str) -> str:
    """The output of a script; ends the program if it fails."""
    script = in_profile(script)
    done = subprocess.run(["bash", "-euo", "pipefail", "-c", script], stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit(f"snippets: exit status {done.returncode} from\n{script}{done.stdout}")
    return done.stdout


def check(path: Path) -> list[str]:
    """What is wrong with the outputs in one file, after all its commands have run."""
    text = path.read_text()
    for block in BLOCK.findall(text):
        script = "".join(line for line in block.splitlines(True) if not line.startswith("./check"))
        print(f"{path}: {script.splitlines()[0] if script else 'nothing to run'}", flush=True)
        run(script)
    outputs = {command: run(command) for _, command, _, _ in OUTPUT.findall(text)}
    wanted = OUTPUT.sub(lambda found: found[1] + outputs[found[2]].rstrip() + "\n" + found[4], text)
    if wanted == text:
        return []
    if os.environ.get("BLESS"):
        path.write_text(wanted)
        return []
    return [f"{path}: an output is not what its command prints; `BLESS=1 ./check docs` writes it"]


if __name__ == "__main__":
    wrong = [message for name in sys.argv[1:] for message in check(Path(name))]
    sys.exit("\n".join(wrong) if wrong else 0)
