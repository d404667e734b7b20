"""Makes sure that the tests run against the installed wheel, not the source folder."""

from pathlib import Path

import pogema_rs

_SOURCE = Path(__file__).resolve().parent.parent


def pytest_configure(config):
    where = Path(pogema_rs.__file__).resolve()
    if where.is_relative_to(_SOURCE):
        raise SystemExit(f"the package under test is {where}, expected an installed wheel")
