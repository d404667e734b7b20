"""Says how many mutants were caught; fails if one was not that stands not in reviewed.txt, or one stands there in vain.

A line of reviewed.txt is the name of a mutant as cargo-mutants tells it, without its line and column, a tab, and why
no test can or need tell it from the original.
"""

import re
import sys
from pathlib import Path

PLACE = re.compile(r":\d+:\d+: ")


def names(path: Path) -> list[str]:
    """The mutants of a list, without their places, which move with every edit."""
    return [PLACE.sub(": ", line) for line in path.read_text().splitlines()] if path.exists() else []


def reviewed(part: str) -> dict[str, str]:
    """The mutants of a part that need not be caught, and why."""
    listed = {}
    for line in Path(__file__).with_name("reviewed.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            name, tab, reason = line.partition("\t")
            if not tab or not reason.strip():
                sys.exit(f"reviewed.txt: no reason for {name}")
            listed[name] = reason
    return {name: reason for name, reason in listed.items() if name.startswith(f"{part}/")}


def main(part: str, folder: Path) -> None:
    """Prints the score of a part."""
    caught = names(folder / "caught.txt") + names(folder / "previously_caught.txt") + names(folder / "timeout.txt")
    missed, unviable, listed = names(folder / "missed.txt"), names(folder / "unviable.txt"), reviewed(part)
    unknown = sorted(set(missed) - listed.keys())
    in_vain = sorted(listed.keys() - set(missed))
    print(f"{part}: {len(caught)} caught, {len(missed)} missed ({len(missed) - len(unknown)} reviewed), "
          f"{len(unviable)} do not build")
    wrong = [f"missed: {name}" for name in unknown] + [f"reviewed in vain: {name}" for name in in_vain]
    sys.exit("\n".join(wrong) if wrong else 0)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
