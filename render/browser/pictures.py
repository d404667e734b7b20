"""Screenshots of the pages for the gallery. If PICTURES is set, they are written to the folder that it names."""

import os
from pathlib import Path

from editor_support import load
from support import settle

MAP = """\
a..#..B
.#.#.#.
...c...
##.#.##
...d...
.#.#.#.
b..#..A
###.###
C.#..D#
"""


def shoot(world, page, name):
    """Takes a screenshot and checks that it is not blank."""
    folder = Path(os.environ.get("PICTURES", world.scratch))
    folder.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=folder / name)
    assert (folder / name).stat().st_size > 20_000, f"{name} is empty"


def test_picture_of_the_replay(world):
    with world.open("soft", "#step=9&agent=3") as page:
        shoot(world, page, "replay.png")


def test_picture_of_the_editor(world):
    with world.open("editor") as page:
        load(world, page, "gallery.txt", MAP)
        page.check("#tint")
        settle(page)
        shoot(world, page, "editor.png")
