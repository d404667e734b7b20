"""Runs the conformance kit on POGEMA's releases and writes docs/survey.md: `python3.11 conformance/ports/survey.py`.

Creates the virtual environments in target/survey/venvs; `--venvs FOLDER` selects another folder. Needs
`target/release/pogema`.
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

# Descriptions of known causes. Other causes are described by their rule and field.
CAUSES = {
    ("config/fields", "error"): "accepts configs that 1.4.0 rejects, or rejects configs that 1.4.0 accepts",
    ("metrics/nothing", "metrics"): "`ep_length` under `nothing` is too small by one",
    ("goal/restart/draw", "goal"): "a next goal may equal the goal just reached",
    ("place/obstacles", "map"): "`width` and `height` are ignored, maps are square",
    ("place/obstacles", "number of map entries"): "`width` and `height` are ignored, maps are square",
}


def environments(folder: Path) -> dict[str, str]:
    """Returns the Python of each release, or why it could not be installed."""
    command = [sys.executable, str(PORTS / "survey_venvs.py"), str(folder)]
    output = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout
    return dict(line.split("\t", 1) for line in output.splitlines())


def survey(pythons: dict[str, str], cases: int, seed: int) -> dict[str, Report]:
    """Runs the kit on each release; returns the reports."""
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
    """Returns one cell of the table."""
    row = report["rules"].get(rule)
    if row is None:
        return ""
    if row["failed"] or row["errors"]:
        return f"✗ {row['failed'] + row['errors']}"
    return "✓" if row["passed"] else "–"


def table(reports: dict[str, Report]) -> list[str]:
    """Returns the table of rules and releases."""
    rules = sorted({rule for report in reports.values() for rule in report["rules"]})
    lines = [f"| rule | {' | '.join(reports)} |", f"| --- |{' --- |' * len(reports)}"]
    for rule in rules:
        lines.append(f"| `{rule}` | {' | '.join(mark(report, rule) for report in reports.values())} |")
    return lines


def request_lines(request: Report) -> list[str]:
    """Returns the lines that describe a request: fields, map and operations."""
    lines = []
    for field, value in request["config"].items():
        if isinstance(value, str) and ("\n" in value or field == "map"):
            lines += [f"{field}:", *(f"  {row}" for row in value.splitlines())]
        else:
            lines.append(f"{field}: {value if isinstance(value, str) else json.dumps(value)}")
    return [*lines, "", "do: " + ", ".join(json.dumps(op) for op in request["ops"])]


def shorten(text: str, longest: int = 160) -> str:
    """Shortens a value to fit on a line."""
    return text if len(text) <= longest else text[: longest - 1] + "…"


def causes(reports: dict[str, Report]) -> list[str]:
    """Returns a section for each cause, with its releases and its smallest counterexample."""
    shown: dict[tuple[str, str], list[tuple[str, Report]]] = defaultdict(list)
    for version, report in reports.items():
        for cause in report["causes"]:
            shown[(cause["rule"] or "(protocol)", cause["what"])].append((version, cause))
    lines = []
    for (rule, what), seen in sorted(shown.items()):
        words = CAUSES.get((rule, what), f"{what} differs")
        times = ", ".join(f"{version} ({cause['times']}×)" for version, cause in seen)
        example = min((cause["example"] for _, cause in seen), key=lambda each: len(json.dumps(each["request"])))
        found = example.get("divergence") or {"expected": "", "got": example.get("fault", {}).get("what", "")}
        given = "an instance" if example["mode"] == "instance" else "a config"
        lines += [f"### `{rule}`: {words}", "", f"Releases: {times}. The port was given {given}.", ""]
        lines += ["```text", *request_lines(example["request"]), ""]
        if "op" in found:
            lines.append(f"after operation {found['op']}, {found['field']}:")
        lines += [f"  expected {shorten(found['expected'])}", f"  got      {shorten(found['got'])}"]
        picture = found.get("picture", "").rstrip("\n").splitlines()
        lines += [*picture[:16], "```", ""]
    return lines


def page(pythons: dict[str, str], reports: dict[str, Report], cases: int, seed: int) -> str:
    """Returns the whole page."""
    missing = [f"- {version}: {why}" for version, why in pythons.items() if version not in reports]
    lines = [
        "# Which release follows which rule",
        "",
        "This page is generated by these commands:",
        "",
        "```text",
        "cargo build --release",
        f"python3.11 conformance/ports/survey.py --cases {cases} --seed {seed}",
        "```",
        "",
        "Each release runs behind `conformance/ports/pogema_python.py`, in its own virtual environment with the "
        "versions that `conformance/ports/survey_venvs.py` pins. The kit plays every hand-written case, every "
        f"recording of 1.4.0 and {cases} random cases, once as instances and once as configs. ✓: the release follows "
        "the rule. ✗ n: n cases or episodes differ. –: the release does not claim the rule, usually because a later "
        "release introduced it. If the starts of agents differ, the comparison of that episode ends there; so ✓ covers "
        "only the steps that could be compared.",
        "",
        *(["Releases that could not be installed:", "", *missing, ""] if missing else []),
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
        "",
        "**What next:** [Known defects and contradictions](spec/defects.md), [Check your port](PORTING.md).",
    ]
    return "\n".join(lines).rstrip() + "\n"


def main() -> None:
    """Creates the environments, runs the kit, writes docs/survey.md."""
    parser = argparse.ArgumentParser(description="Runs the conformance kit on POGEMA's releases.")
    parser.add_argument("--cases", type=int, default=1000, help="number of random cases [default: 1000]")
    parser.add_argument("--seed", type=int, default=7, help="seed of the random cases [default: 7]")
    venvs = "folder of the virtual environments [default: target/survey/venvs]"
    parser.add_argument("--venvs", type=Path, default=WORK / "venvs", help=venvs)
    options = parser.parse_args()
    WORK.mkdir(parents=True, exist_ok=True)
    found = environments(options.venvs)
    pythons = {version: python for version, python in found.items() if Path(python).exists()}
    reports = survey(pythons, options.cases, options.seed)
    (ROOT / "docs" / "survey.md").write_text(page(found, reports, options.cases, options.seed))


if __name__ == "__main__":
    main()
