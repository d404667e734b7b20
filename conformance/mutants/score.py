"""Says how many mutants were caught; fails if one was not that stands not in reviewed.txt, or one stands there in vain.

A line of reviewed.txt is the name of a mutant as cargo-mutants tells it, without its line and column, a tab, and why
no test can or need tell it from the original.
"""

import re
import sys
from pathlib import Path

PLACE = re.compile(r":\d+:\d+: ")


def names(path: Path, with_places: bool = False) -> list[str]:
    """The mutants of a list, by default without their places, which move with every edit."""
    lines = path.read_text().splitlines() if path.exists() else []
    return lines if with_places else [PLACE.sub(": ", line) for line in lines]


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


def main(part: str, folder: Path, total: int) -> None:
    """Prints the score of a part."""
    endless = set(names(folder.parent / "timeouts.txt", with_places=True))
    missed = [name for name in names(folder / "missed.txt", with_places=True) if name not in endless]
    missed, listed = [PLACE.sub(": ", name) for name in missed], reviewed(part)
    unknown = sorted(set(missed) - listed.keys())
    in_vain = sorted(listed.keys() - set(missed))
    num_reviewed = sum(name in listed for name in missed)
    print(f"{part}: of {total} mutants {len(missed)} missed, of which {num_reviewed} are reviewed")
    wrong = [f"missed: {name}" for name in unknown] + [f"reviewed in vain: {name}" for name in in_vain]
    sys.exit("\n".join(wrong) if wrong else 0)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]))
