"""Runs the kit on POGEMA's releases and writes what it finds as a page: `python3.11 conformance/ports/survey.py`.

The environments are made below target/survey (`--venvs FOLDER` for another place). Needs `target/release/pogema`.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

PORTS = Path(__file__).resolve().parent
ROOT = PORTS.parent.parent
WORK = ROOT / "target" / "survey"
Report = dict[str, Any]

# What a cause comes down to, in words; a cause that is not told here is told by its rule and field alone.
WORDS = {
    ("config/fields", "error"): "configs that 1.4.0 takes are refused, or others taken",
    ("metrics/nothing", "metrics"): "`ep_length` under `nothing` is one too small",
    ("goal/restart/draw", "goal"): "a next goal may be the cell just reached",
    ("place/obstacles", "map"): "`width` and `height` are ignored, maps are squares",
    ("place/obstacles", "number of map entries"): "`width` and `height` are ignored, maps are squares",
}


def environments(folder: Path) -> dict[str, str]:
    """For each release its python, or why it has none."""
    command = [sys.executable, str(PORTS / "survey_venvs.py"), str(folder)]
    told = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout
    return dict(line.split("\t", 1) for line in told.splitlines())


def survey(pythons: dict[str, str], cases: int, seed: int) -> dict[str, Report]:
    """For each release what the kit finds."""
    reports = {}
    for version, python in pythons.items():
        print(f"POGEMA {version}", file=sys.stderr, flush=True)
        path = WORK / f"{version}.json"
        command = [str(ROOT / "target/release/pogema"), "conform", "--cases", str(cases), "--seed", str(seed)]
        command += ["--port", f"{python} {PORTS / 'pogema_python.py'}", "--json", str(path)]
        done = subprocess.run([*command, "--keep", str(WORK / version)], stdout=subprocess.DEVNULL)
        if done.returncode not in (0, 1):
            sys.exit(f"survey: POGEMA {version}: exit status {done.returncode}")
        (reports[version],) = json.loads(path.read_text())
    return reports


def mark(report: Report, rule: str) -> str:
    """One cell of the table."""
    row = report["rules"].get(rule)
    if row is None:
        return ""
    if row["failed"] or row["errors"]:
        return f"✗ {row['failed'] + row['errors']}"
    return "✓" if row["passed"] else "–"


def table(reports: dict[str, Report]) -> list[str]:
    """Every rule that was checked against every release."""
    rules = sorted({rule for report in reports.values() for rule in report["rules"]})
    lines = [f"| rule | {' | '.join(reports)} |", f"| --- |{' --- |' * len(reports)}"]
    for rule in rules:
        lines.append(f"| `{rule}` | {' | '.join(mark(report, rule) for report in reports.values())} |")
    return lines


def told_config(request: Report) -> list[str]:
    """A request as its reader sees it: fields, map, and what is done."""
    lines = []
    for field, value in request["config"].items():
        if isinstance(value, str) and ("\n" in value or field == "map"):
            lines += [f"{field}:", *(f"  {row}" for row in value.splitlines())]
        else:
            lines.append(f"{field}: {value if isinstance(value, str) else json.dumps(value)}")
    return [*lines, "", "do: " + ", ".join(json.dumps(op) for op in request["ops"])]


def shorten(text: str, longest: int = 160) -> str:
    """A value that fits a line."""
    return text if len(text) <= longest else text[: longest - 1] + "…"


def causes(reports: dict[str, Report]) -> list[str]:
    """Each cause with the releases that show it and its smallest counterexample."""
    shown: dict[tuple[str, str], list[tuple[str, Report]]] = defaultdict(list)
    for version, report in reports.items():
        for cause in report["causes"]:
            shown[(cause["rule"] or "(protocol)", cause["what"])].append((version, cause))
    lines = []
    for (rule, what), seen in sorted(shown.items()):
        words = WORDS.get((rule, what), f"{what} differs")
        times = ", ".join(f"{version} ({cause['times']}×)" for version, cause in seen)
        example = min((cause["example"] for _, cause in seen), key=lambda each: len(json.dumps(each["request"])))
        found = example.get("divergence") or {"expected": "", "got": example.get("fault", {}).get("what", "")}
        given = "an instance" if example["mode"] == "instance" else "a config"
        lines += [f"### `{rule}`: {words}", "", f"Releases: {times}. The port was given {given}.", ""]
        lines += ["```text", *told_config(example["request"]), ""]
        if "op" in found:
            lines.append(f"after operation {found['op']}, {found['field']}:")
        lines += [f"  expected {shorten(found['expected'])}", f"  got      {shorten(found['got'])}"]
        picture = found.get("picture", "").rstrip("\n").splitlines()
        lines += [*picture[:16], "```", ""]
    return lines


def page(pythons: dict[str, str], reports: dict[str, Report], cases: int, seed: int) -> str:
    """The whole page."""
    missing = [f"- {version}: {why}" for version, why in pythons.items() if version not in reports]
    lines = [
        "# Which release follows which rule",
        "",
        "This page is written by a program and was checked in as it came:",
        "",
        "```text",
        "cargo build --release",
        f"python3.11 conformance/ports/survey.py --cases {cases} --seed {seed}",
        "```",
        "",
        "Each release runs in a virtual environment of its own, with the pins that `conformance/ports/survey_venvs.py` "
        "lists, behind `conformance/ports/pogema_python.py`. It is given every hand-written case, every recording of "
        f"1.4.0 and {cases} drawn cases, once as instances and once as configs. ✓: all as the rule says. ✗: so many "
        "cases or episodes otherwise. –: the release does not claim it, mostly since it came later. A difference in "
        "where agents start ends the comparison of an episode, so a rule marked ✓ held wherever it could be seen.",
        "",
        *(["Could not be installed:", "", *missing, ""] if missing else []),
        *[
            f"POGEMA {version}: {report['num_played']} cases and {report['num_steps']} steps played, "
            f"{len(report['causes'])} causes of differences."
            + "  "
            for version, report in reports.items()
        ],
        "",
        "## Rules",
        "",
        *table(reports),
        "",
        "## Smallest counterexamples",
        "",
        *causes(reports),
    ]
    return "\n".join(lines).rstrip() + "\n"


def main() -> None:
    """Makes environments, runs the kit, writes docs/survey.md."""
    parser = argparse.ArgumentParser(description="Runs the kit on POGEMA's releases.")
    parser.add_argument("--cases", type=int, default=1000, help="how many cases to draw")
    parser.add_argument("--seed", type=int, default=7, help="seed of the drawn cases")
    parser.add_argument("--venvs", type=Path, default=WORK / "venvs", help="where the environments are made")
    options = parser.parse_args()
    WORK.mkdir(parents=True, exist_ok=True)
    told = environments(options.venvs)
    pythons = {version: python for version, python in told.items() if Path(python).exists()}
    reports = survey(pythons, options.cases, options.seed)
    (ROOT / "docs" / "survey.md").write_text(page(told, reports, options.cases, options.seed))


if __name__ == "__main__":
    main()
