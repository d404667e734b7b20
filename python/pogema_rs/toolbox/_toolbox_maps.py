"""Reads the maps that an installed pogema-toolbox contains."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

from pogema_rs._optional import import_optional

#: A map that only pogema-toolbox contains.
LOGO = "pogema-logo"


def toolbox_maps() -> dict[str, str]:
    """Returns the map texts of the installed pogema-toolbox by name; without it, there are none."""
    try:
        listed = files("pogema-toolbox") or []
    except PackageNotFoundError:
        return {}
    maps: dict[str, str] = {}
    for file in listed:
        if file.match("pogema_toolbox/maps/*.yaml"):
            text = Path(str(file.locate())).read_text(encoding="utf-8")
            maps.update(import_optional("yaml", "reading the maps of pogema-toolbox").safe_load(text) or {})
    return maps
