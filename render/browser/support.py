"""Opens pages, and fails a test if its page logs an error or sends a network request."""

import json
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync"
).split()


PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True, "device_scale_factor": 3}


class World:
    """A browser, the pages and the program that made them."""

    def __init__(self, browser, folder, program, scratch):
        self.browser, self.folder, self.program, self.scratch = browser, Path(folder), program, Path(scratch)
        self.episodes = {}

    def episode(self, name):
        if name not in self.episodes:
            self.episodes[name] = json.loads((self.folder / f"{name}.json").read_text())
        return self.episodes[name]

    @contextmanager
    def open(self, name, fragment="", path=None, **options):
        """Opens a page in a new context; fails on exit if the page caused errors."""
        errors = []
        options = {"viewport": {"width": 1200, "height": 800}, **options}
        context = self.browser.new_context(accept_downloads=True, **options)
        context.set_default_timeout(10_000)
        page = context.new_page()
        address = (path or self.folder / f"{name}.html").resolve().as_uri()
        page.errors = errors
        page.on("console", lambda message: is_bad(message) and errors.append(message.text))
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("request", lambda request: is_foreign(request.url, address) and errors.append(request.url))
        # The editor asks for confirmation before it discards a changed map.
        page.on("dialog", lambda dialog: dialog.accept() if dialog.type == "beforeunload" else errors.append("dialog"))
        page.goto(address + fragment)
        page.wait_for_selector("body.ready")
        settle(page)
        try:
            yield page
        finally:
            context.close()
        assert not errors, errors

    def check(self, *paths):
        """Returns what the Rust side reads from saved maps; fails if it cannot read one or generate an instance."""
        command = [self.program, "check", *map(str, paths)]
        output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        read = [json.loads(line) for line in output.splitlines()]
        for path, content in zip(paths, read):
            assert "error" not in content, (path.read_text(), content["error"])
        return read


def is_bad(message):
    # The tests cause this warning, because they read pixels back. The pages do not read pixels back.
    return message.type in ("error", "warning") and "willReadFrequently" not in message.text


def is_foreign(url, address):
    return url.split("#")[0] != address and not url.startswith(("data:", "blob:"))


def settle(page):
    """Waits until the requested frame is drawn."""
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def wait(page, expression, seconds=10):
    """Waits until an expression is true.

    With an expression instead of a function, Playwright's `wait_for_function` needs `eval`, which the pages' policy
    forbids.
    """
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, f"`{expression}` did not become true"
        page.wait_for_timeout(20)


def text(page, name):
    return page.text_content(f"#{name}").strip()


def place(cell):
    return f"({cell[0]}, {cell[1]})"


def stage(page):
    return page.locator("#stage").bounding_box()


def on_screen(page, tool, row, col):
    """Returns the centre of a cell, in pixels of the page."""
    box = stage(page)
    x, y = page.evaluate(f"([row, col]) => window.{tool}.center(row, col)", [row, col])
    # The box includes the border of the stage, one pixel wide.
    return box["x"] + 1 + x, box["y"] + 1 + y


def touches(page):
    """Returns a function that sends one touch event, given its type, and the number, x and y of each finger."""
    session = page.context.new_cdp_session(page)

    def touch(kind, *fingers):
        points = [{"id": number, "x": x, "y": y} for number, x, y in fingers]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    return touch


def pixel(page, canvas, x, y):
    """Returns red, green, blue and alpha of a canvas at a position on the stage."""
    return page.evaluate(
        """([id, x, y]) => {
          const canvas = document.getElementById(id);
          const ratio = canvas.width / canvas.clientWidth;
          return [...canvas.getContext("2d").getImageData(Math.round(x * ratio), Math.round(y * ratio), 1, 1).data];
        }""",
        [canvas, x, y],
    )


def equal(got, expected, what=""):
    assert got == expected, f"{what}: got {got!r}, expected {expected!r}"


def check_names_of_buttons(page):
    unnamed = page.evaluate(
        "[...document.querySelectorAll('button')]"
        ".filter((button) => !(button.getAttribute('aria-label') || button.textContent.trim())).length"
    )
    equal(unnamed, 0, "buttons without a name")


def step(page):
    """Returns the step that the page shows."""
    return int(text(page, "step").split()[1])
