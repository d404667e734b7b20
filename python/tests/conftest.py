"""Makes sure that the tests run against the installed wheel, and marks those that need POGEMA."""

from pathlib import Path

import pogema_rs

_SOURCE = Path(__file__).resolve().parent.parent


def pytest_configure(config):
    config.addinivalue_line("markers", "slow: the test takes long; `./check slow` runs it")
    config.addinivalue_line(
        "markers",
        "oracle: the test needs POGEMA 1.4.0 in POGEMA_ORACLE_PYTHON, or pogema-toolbox in POGEMA_TOOLBOX_FOLDER",
    )
    where = Path(pogema_rs.__file__).resolve()
    if where.is_relative_to(_SOURCE):
        raise SystemExit(f"the package under test is {where}, expected an installed wheel")


def pytest_collection_modifyitems(items):
    need_pogema = {
        path for path in {item.path for item in items} if "POGEMA_ORACLE_PYTHON" in path.read_text(encoding="utf-8")
    }
    for item in items:
        # Each process of a Dask cluster takes seconds to start.
        if "dask" in item.name:
            item.add_marker("slow")
        if item.path in need_pogema:
            item.add_marker("oracle")
