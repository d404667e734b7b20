"""Helpers for the tests of the editor."""

import random

from playwright.sync_api import TimeoutError
from support import on_screen, settle, text, wait


def at(page, row, col):
    return on_screen(page, "editor", row, col)


def drag(page, *cells):
    page.mouse.move(*at(page, *cells[0]))
    page.mouse.down()
    for cell in cells[1:]:
        page.mouse.move(*at(page, *cell), steps=3)
    page.mouse.up()
    settle(page)


def click_cell(page, *cell):
    drag(page, cell)


def rows(page):
    return page.evaluate("editor.rows")


def pairs(page):
    return [[agent["start"], agent["goal"]] for agent in page.evaluate("editor.agents")]


def resize(page, height, width, how="resize"):
    page.fill("#height", str(height))
    page.fill("#width", str(width))
    page.click(f"#{how}")
    settle(page)


def save(world, page, kind):
    # Chromium drops the eleventh download of a page within a second, without a message.
    page.wait_for_timeout(110)
    try:
        with page.expect_download(timeout=30000) as download:
            page.click("#save-text" if kind == "txt" else "#save-yaml")
    except TimeoutError as error:
        raise AssertionError(f"nothing was saved: {text(page, 'message')}") from error
    path = world.scratch / f"saved-{random.getrandbits(40):x}.{kind}"
    download.value.save_as(path)
    return path


def yaml_of(page):
    """Returns the config that the dialog shows."""
    page.click("#edit-source")
    page.click("#source-as-yaml")
    shown = page.input_value("#source-text")
    page.click("#source-close")
    return shown


def asks_before_closing(page):
    """Returns whether closing the page asks for confirmation."""
    return page.evaluate("!dispatchEvent(new Event('beforeunload', { cancelable: true }))")


def load(world, page, name, content):
    path = world.scratch / name
    path.write_text(content)
    pick(page, path)
    return path


def pick(page, path):
    page.set_input_files("#picker", path)
    wait_until_loaded(page)


def wait_until_loaded(page):
    """Waits until a selected or dropped file is loaded and drawn."""
    wait(page, "!document.body.hasAttribute('aria-busy')")
    settle(page)


def paste(page, content):
    page.evaluate(
        """(content) => {
          const data = new DataTransfer();
          data.setData("text/plain", content);
          document.body.dispatchEvent(new ClipboardEvent("paste", { clipboardData: data, bubbles: true }));
        }""",
        content,
    )
    settle(page)


def drop(page, name, content):
    drop_without_waiting(page, name, content)
    wait_until_loaded(page)


def drop_without_waiting(page, name, content):
    """Drops a file without waiting until it is loaded."""
    page.evaluate(
        """([name, content]) => {
          const data = new DataTransfer();
          data.items.add(new File([content], name));
          for (const kind of ["dragover", "drop"]) {
            document.body.dispatchEvent(new DragEvent(kind, { dataTransfer: data, bubbles: true, cancelable: true }));
          }
        }""",
        [name, content],
    )
