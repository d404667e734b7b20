"""Reads maps of the MovingAI benchmark, without the ring of cells at their border."""

from __future__ import annotations

import io
import urllib.request
import zipfile
from typing import IO

from pogema_rs import _engine
from pogema_rs.toolbox.generators.generator_utils import maps_dict_to_yaml

__all__ = ["download_moving_ai_maps", "map_to_grid", "maps_dict_to_yaml"]


def download_moving_ai_maps(url: str) -> dict[str, str]:
    """Returns the maps of a zip archive as texts, by file name without `.map`.

    Errors: `OSError` for an archive that cannot be downloaded, `zipfile.BadZipFile` or `ValueError` for a wrong file.

    Source: pogema-toolbox 0.1.1, `moving_ai_ingestion.py`, `download_moving_ai_maps`
    """
    with urllib.request.urlopen(url) as response:
        archive = zipfile.ZipFile(io.BytesIO(response.read()))
    with archive:
        names = [name for name in archive.namelist() if name.endswith(".map")]
        return {name.replace(".map", ""): map_to_grid(archive.open(name)) for name in names}


def map_to_grid(file_in_zip: IO[bytes], remove_border: bool = True) -> str:
    """Converts a map from MovingAI's format to POGEMA's text, and closes its file; `@`, `O` and `T` are obstacles.

    Errors: `ValueError` that names the line, for a wrong file.

    Source: pogema-toolbox 0.1.1, `moving_ai_ingestion.py`, `map_to_grid`
    """
    with file_in_zip:
        return _engine.movingai_map(file_in_zip.read().decode("utf-8"), not remove_border)
