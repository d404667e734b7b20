"""Tests the metadata of the installed package: licences, description and links."""

import re
from importlib.metadata import distribution
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
INSTALLED = distribution("pogema-rs")


def test_licences_are_in_the_wheel():
    names = INSTALLED.metadata.get_all("License-File")
    assert names is not None and sorted(names) == ["LICENSE-APACHE", "LICENSE-MIT", "THIRD-PARTY.txt"]
    for name in names:
        original = ROOT / "python" / name
        assert INSTALLED.read_text(f"licenses/{name}") == original.read_text(encoding="utf-8")


def test_description_has_no_relative_links():
    description = INSTALLED.metadata.get_payload()
    assert description.strip() == (ROOT / "python" / "README.md").read_text(encoding="utf-8").strip()
    targets = re.findall(r"\]\(([^)]*)\)", description)
    assert len(targets) > 3
    assert [target for target in targets if not target.startswith("https://")] == []


def test_links_to_the_repository_lead_to_files():
    prefix = "https://github.com/pogema-rs/pogema-rs/blob/main/"
    texts = [INSTALLED.metadata.get_payload(), *(INSTALLED.metadata.get_all("Project-URL") or [])]
    paths = [path for text in texts for path in re.findall(re.escape(prefix) + r"([^)#\s]*)", text)]
    assert len(paths) > 4
    assert [path for path in paths if not (ROOT / path).is_file()] == []
