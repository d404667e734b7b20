"""Prints how many mutants were missed; fails if a missed mutant is not in reviewed.txt, or if an entry is outdated.

A line of reviewed.txt has three parts: the name of a mutant, a tab, and the reason why no test can or needs to detect
the mutant. The name is the one that cargo-mutants prints, but without line and column.
"""

import re
import sys
from pathlib import Path

PLACE = re.compile(r":\d+:\d+: ")


def names(path: Path, with_places: bool = False) -> list[str]:
    """Returns the mutants of a list, by default without line and column, which change with every edit."""
    lines = path.read_text().splitlines() if path.exists() else []
    return lines if with_places else [PLACE.sub(": ", line) for line in lines]


def reviewed(part: str) -> dict[str, str]:
    """Returns the reviewed mutants of a part, each with its reason."""
    listed = {}
    for line in Path(__file__).with_name("reviewed.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            name, tab, reason = line.partition("\t")
            if not tab or not reason.strip():
                sys.exit(f"reviewed.txt: found no reason after `{name}`, expected a tab and a reason")
            listed[name] = reason
    return {name: reason for name, reason in listed.items() if name.startswith(f"{part}/")}


def main(part: str, folder: Path, total: int) -> None:
    """Prints the score of a part; fails if reviewed.txt does not list exactly the missed mutants of the part."""
    timed_out = set(names(folder.parent / "timeouts.txt", with_places=True))
    missed = [name for name in names(folder / "missed.txt", with_places=True) if name not in timed_out]
    missed, listed = [PLACE.sub(": ", name) for name in missed], reviewed(part)
    unknown = sorted(set(missed) - listed.keys())
    outdated = sorted(listed.keys() - set(missed))
    num_reviewed = sum(name in listed for name in missed)
    print(f"{part}: missed {len(missed)} of {total} mutants; {num_reviewed} of the missed are reviewed")
    wrong = [f"missed: {name}" for name in unknown] + [f"reviewed, but not missed: {name}" for name in outdated]
    sys.exit("\n".join(wrong) if wrong else 0)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]))
