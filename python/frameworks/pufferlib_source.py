"""Fetches the Python sources of PufferLib into a folder: pufferlib_source.py VERSION FOLDER.

Its release is a source archive. Building it downloads a graphics library that our tests do not use.
"""

import sys
import tarfile
import tempfile
import urllib.request
from pathlib import Path, PurePosixPath

from distlib.locators import locate


def main(version: str, folder: Path) -> None:
    """Extracts the modules of PufferLib, without its environments, to `folder/pufferlib`."""
    found = locate(f"pufferlib ({version})")
    if found is None:
        sys.exit(f"pufferlib_source: found no release {version} of pufferlib")
    with tempfile.NamedTemporaryFile(suffix=".tar.gz") as archive:
        urllib.request.urlretrieve(found.source_url, archive.name)
        with tarfile.open(archive.name) as files:
            for file in files:
                path = PurePosixPath(*PurePosixPath(file.name).parts[1:])
                if (
                    path.match("pufferlib/*.py")
                    and len(path.parts) == 2
                    or path.match("pufferlib/environments/__init__.py")
                ):
                    file.name = str(path)
                    files.extract(file, folder, filter="data")


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
