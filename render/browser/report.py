"""The report of an evaluation has tables and plots, replays its episodes and fits a phone."""

import base64
import json
import os
import subprocess
from html import unescape

from support import PHONE, equal, settle, text, wait

SUITE = """
environment:
  name: Environment
  on_target: nothing
  collision_system: soft
  max_episode_steps: 64
  size: 12
  density: 0.2
  seed: {grid_search: [1, 2, 3, 4]}
  num_agents: {grid_search: [4, 12]}
algorithms:
  LaCAM: {name: LaCAM, nodes: 500}
  "<b>A star&": {name: "A*"}
results_views:
  Means: {type: tabular, drop_keys: [seed]}
  "SoC </script><script>alert(1)</script>": {type: plot, x: num_agents, y: SoC}
  Absent: {type: plot, x: num_agents, y: throughput}
"""


def report(world):
    """Returns the page, which is made once, and its rows."""
    folder = world.scratch / "report"
    if not folder.exists():
        folder.mkdir()
        (folder / "suite.yaml").write_text(SUITE)
        command = [os.environ["POGEMA_PROGRAM"], "evaluate", "suite.yaml", "--out", "out", "--html"]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
    rows = {path.stem: json.loads(path.read_text()) for path in (folder / "out").glob("*.json") if has_rows(path)}
    return folder / "out" / "report.html", rows


def has_rows(path):
    return path.name != "about.json" and not path.name.endswith(".episodes.json")


def test_tables_and_plots_are_shown(world):
    path, rows = report(world)
    with world.open("report", path=path) as page:
        equal(text(page, "title"), "suite")
        headings = page.locator("h2").all_text_contents()
        assert "SoC </script><script>alert(1)</script>" in headings, headings
        lines = page.locator(".views table").first.locator("tbody tr")
        equal(lines.count(), 4, "two algorithms with two numbers of agents")
        equal(sorted(rows), ["<b>A star&", "LaCAM"])
        equal(page.locator("img").count(), 1)
        assert page.evaluate("[...document.images].every((image) => image.complete && image.naturalWidth > 100)")
        svg = base64.b64decode(page.locator("img").get_attribute("src").split(",")[1]).decode()
        assert "<svg" in svg and "LaCAM" in unescape(svg)
        note = page.locator("section", has_text="Absent").locator(".note").first.text_content()
        assert "`y` is `throughput`, expected a metric of the results" in note, note


def test_episodes_say_by_which_metric_they_are_ranked(world):
    path, _ = report(world)
    with world.open("report", path=path) as page:
        assert "ranked by ISR (higher is better), then by SoC (lower is better)" in page.content()
        badges = page.locator(".worst, .best").all_text_contents()
        equal(len(badges), 2 * 6)
        assert set(badges) <= {"worst by ISR", "worst by SoC", "best by ISR", "best by SoC"}, badges
        assert "best by SoC" in badges, badges


def test_replays_match_their_episodes(world):
    path, rows = report(world)
    with world.open("report", path=path) as page:
        buttons = page.locator("[data-replay]")
        equal(buttons.count(), 2 * 6)
        for number in (0, 5, 6, 11):
            name, episode = (
                buttons.nth(number).get_attribute("aria-label").removeprefix("replay episode ").split(" of ")[::-1]
            )
            buttons.nth(number).click()
            frame = page.frame_locator("#player iframe").locator("body.ready")
            frame.wait_for()
            inner = page.frames[-1]
            metrics = rows[name][int(episode)]["metrics"]
            equal(inner.evaluate("replay.numSteps"), metrics["ep_length"], f"{name} {episode}")
            equal(inner.evaluate("replay.numAgents"), rows[name][int(episode)]["env_grid_search"]["num_agents"])
            assert f"SoC {metrics['SoC']}" in inner.locator("#metrics").text_content()
            assert f"episode {episode}" in inner.locator("h1").text_content()
            inner.click("#last")
            wait(inner, "replay.step === replay.numSteps")
            page.click("#player-close")
            assert page.locator("#player").is_hidden()
            wait(page, "document.querySelector('iframe') === null")


def test_a_replay_opens_in_a_new_tab(world):
    path, _ = report(world)
    with world.open("report", path=path) as page:
        page.locator("[data-replay]").first.click()
        with page.context.expect_page() as opened:
            page.click("#player-tab")
        opened.value.wait_for_selector("body.ready")
        assert opened.value.evaluate("replay.numSteps") > 0


def test_the_report_fits_a_phone(world):
    path, _ = report(world)
    with world.open("report", path=path, **PHONE) as page:
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "the page is wider than the phone"
        wide = page.locator(".wide").first
        assert wide.evaluate("(box) => box.scrollWidth > box.clientWidth"), "the wide table does not scroll"
        equal(
            wide.evaluate("(box) => getComputedStyle(box).backgroundAttachment"),
            "local, scroll",
            "its end has a shadow",
        )
        page.locator("[data-replay]").first.tap()
        page.frame_locator("#player iframe").locator("body.ready").wait_for()
        settle(page)
        box = page.locator("#player").bounding_box()
        assert (box["x"], box["width"]) == (0, 390) and box["height"] <= 844, box
        inner = page.frames[-1]
        assert inner.evaluate("document.documentElement.scrollWidth <= innerWidth")
        page.locator("#player-close").tap()
        assert page.locator("#player").is_hidden()


def test_no_foreign_scripts_run(world):
    path, _ = report(world)
    with world.open("report", path=path) as page:
        equal(page.evaluate("document.scripts.length"), 2, "the data and the page's script")
        refused = page.evaluate("fetch('http://127.0.0.1:9/').then(() => 'sent', (error) => error.name)")
        equal(refused, "TypeError")
        assert page.errors and all("Content Security Policy" in one for one in page.errors), page.errors
        page.errors.clear()
