"""The replay page responds to buttons, keys, mouse, touch and deep links, and uses no network."""

import time

from support import PHONE, check_names_of_buttons, equal, on_screen, pixel, settle, stage, step, text, touches, wait


def test_the_play_button_plays_pauses_and_starts_again(world):
    with world.open("restart") as page:
        page.click("#play")
        wait(page, "replay.step >= 2")
        equal(page.get_attribute("#play", "aria-label"), "pause")
        page.keyboard.press("Escape")
        page.click("#play")
        settle(page)
        at = step(page)
        assert at >= 2 and not page.evaluate("replay.isPlaying")
        time.sleep(0.4)
        equal(step(page), at, "paused")
        page.focus("#stage")
        page.keyboard.press("Space")
        page.select_option("#speed", "64")
        wait(page, "replay.step === replay.numSteps")
        settle(page)
        equal(text(page, "step"), "step 64 / 64")
        equal(page.get_attribute("#play", "aria-label"), "play")
        page.click("#play")
        wait(page, "replay.step < 60")


def test_buttons_and_keys_change_the_step(world):
    with world.open("restart") as page:
        for how, expected in [("#next", 1), ("#next", 2), ("#back", 1), ("#last", 64), ("#first", 0)]:
            page.click(how)
            settle(page)
            equal(step(page), expected, how)
        keys = [
            ("ArrowRight", 1),
            ("Shift+ArrowRight", 11),
            ("ArrowLeft", 10),
            ("End", 64),
            ("ArrowRight", 64),
            ("Home", 0),
            ("ArrowLeft", 0),
        ]
        for key, expected in keys:
            page.keyboard.press(key)
            settle(page)
            equal(step(page), expected, key)
            equal(page.input_value("#scrub"), str(expected), "slider")


def test_the_slider_changes_the_step(world):
    with world.open("restart") as page:
        box = page.locator("#scrub").bounding_box()
        middle = box["y"] + box["height"] / 2
        page.mouse.move(box["x"] + 8, middle)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] / 2, middle, steps=5)
        settle(page)
        assert 30 <= step(page) <= 34, step(page)
        page.mouse.move(box["x"] + box["width"], middle, steps=5)
        page.mouse.up()
        settle(page)
        equal(step(page), 64)


def test_the_address_sets_step_and_agent(world):
    with world.open("restart", "#step=12&agent=3") as page:
        equal((step(page), text(page, "agent-name")), (12, "Agent 3"))
        page.keyboard.press("ArrowRight")
        page.keyboard.press("]")
        wait(page, "location.hash === '#step=13&agent=4'")
        page.evaluate("location.hash = '#step=40&agent=0'")
        wait(page, "replay.step === 40")
        equal(text(page, "agent-name"), "Agent 0")
    for bad in ("#step=999&agent=8", "#step=-1&agent=<b>", "#step=1e1&%"):
        with world.open("restart", bad) as page:
            equal((step(page), page.evaluate("replay.agent")), (0, None), bad)


def test_dragging_the_slider_writes_the_address_once(world):
    with world.open("restart") as page:
        page.evaluate("""() => {
            window.numWrites = 0;
            const write = history.replaceState.bind(history);
            history.replaceState = (...given) => { window.numWrites += 1; write(...given); };
            const scrub = document.getElementById("scrub");
            for (let at = 0; at < 300; at += 1) {
                scrub.value = at % 60;
                scrub.dispatchEvent(new Event("input"));
            }
        }""")
        wait(page, "location.hash === '#step=59'")
        equal(page.evaluate("numWrites"), 1)
        page.keyboard.press("ArrowRight")
        page.evaluate("""() => {
            Object.defineProperty(document, "hidden", { value: true });
            document.dispatchEvent(new Event("visibilitychange"));
        }""")
        equal(page.evaluate("location.hash"), "#step=60")


def test_agents_glide_between_steps(world):
    with world.open("restart") as page:
        page.select_option("#speed", "1")
        page.uncheck("#numbers")
        page.uncheck("#goals")
        settle(page)
        page.click("#play")
        # Waits for two different pictures of the same step, so the speed of the machine does not matter.
        page.evaluate("window.seen = []")
        wait(
            page,
            """(() => {
              const now = [replay.step, document.getElementById("actors").toDataURL()];
              window.seen.push(now);
              return window.seen.some(([step, picture]) => step === now[0] && picture !== now[1]);
            })()""",
        )


def test_goals_show_numbers(world):
    with world.open("restart") as page:

        def has_number(cell):
            # Reads only the inside of the goal's ring, where its number is.
            x, y = page.evaluate("([row, col]) => replay.center(row, col)", cell)
            reach = page.evaluate("replay.scale") / 5
            return page.evaluate(
                """([x, y, reach]) => {
                  const canvas = document.getElementById("actors");
                  const ratio = canvas.width / canvas.clientWidth;
                  const part = [x - reach, y - reach, 2 * reach, 2 * reach].map((value) => Math.round(value * ratio));
                  return canvas.getContext("2d").getImageData(...part).data.some((value) => value > 0);
                }""",
                [x, y, reach],
            )

        state = world.episode("restart")["states"][0]
        free = [goal for goal in state["goals"] if goal not in state["cells"]]
        assert free
        for goal in free:
            assert has_number(goal), f"no number at {goal}"
        page.uncheck("#numbers")
        settle(page)
        for goal in free:
            assert not has_number(goal), f"a number at {goal}"


def test_the_list_of_agents_uses_the_free_space(world):
    for name, height in (("restart", 800), ("large", 500), ("large", 800)):
        with world.open(name, viewport={"width": 1200, "height": height}) as page:
            is_whole = page.evaluate(
                "(({ scrollHeight, clientHeight }) => scrollHeight <= clientHeight)(document.getElementById('agents'))"
            )
            spare = page.evaluate(
                "document.querySelector('aside').getBoundingClientRect().bottom"
                " - document.getElementById('no-agent').parentElement.getBoundingClientRect().bottom"
            )
            equal(is_whole, name == "restart")
            assert is_whole or spare < 2, (height, spare)


def test_only_the_main_button_selects(world):
    with world.open("restart", "#agent=0") as page:
        cell = world.episode("restart")["states"][0]["cells"][1]
        page.mouse.click(*on_screen(page, "replay", *cell), button="right")
        equal(page.evaluate("replay.agent"), 0)
        page.mouse.click(*on_screen(page, "replay", *cell))
        equal(page.evaluate("replay.agent"), 1)


def test_the_map_can_be_zoomed_dragged_and_fitted(world):
    with world.open("restart") as page:
        x, y = on_screen(page, "replay", 3, 4)
        fitted = page.evaluate("replay.scale")
        page.mouse.move(x, y)
        page.mouse.wheel(0, -300)
        settle(page)
        assert page.evaluate("replay.scale") > 1.5 * fitted
        near = on_screen(page, "replay", 3, 4)
        assert abs(near[0] - x) < 1 and abs(near[1] - y) < 1, "the cell under the pointer moved"
        page.mouse.down()
        page.mouse.move(x + 60, y + 40, steps=4)
        page.mouse.up()
        moved = on_screen(page, "replay", 3, 4)
        assert abs(moved[0] - x - 60) < 1 and abs(moved[1] - y - 40) < 1, moved
        assert page.evaluate("replay.agent") is None, "the drag selected an agent"
        page.click("#fit")
        equal(page.evaluate("replay.scale"), fitted)
        for how in ("#zoom-in", "#zoom-out"):
            page.click(how)
        page.focus("#stage")
        page.keyboard.press("+")
        assert page.evaluate("replay.scale") > fitted
        page.keyboard.press("f")
        equal(page.evaluate("replay.scale"), fitted)


def test_touch_zooms_drags_and_selects(world):
    with world.open("restart", **PHONE) as page:
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "the page is wider than the phone"
        box, fitted = stage(page), page.evaluate("replay.scale")
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        touch = touches(page)
        touch("touchStart", (0, x - 30, y), (1, x + 30, y))
        for spread in (40, 50, 60):
            touch("touchMove", (0, x - spread, y), (1, x + spread, y))
        touch("touchEnd")
        settle(page)
        assert 1.6 * fitted < page.evaluate("replay.scale") < 2.4 * fitted, page.evaluate("replay.scale")
        before = page.evaluate("replay.center(0, 0)")
        touch("touchStart", (0, x, y))
        for at in (x - 20, x - 40, x - 60, x - 60, x - 60):
            touch("touchMove", (0, at, y))
            page.wait_for_timeout(40)
        touch("touchEnd")
        assert page.evaluate("replay.center(0, 0)")[0] < before[0] - 40
        # A tap too soon after a drag only stops the drag.
        page.wait_for_timeout(500)
        page.tap("#fit")
        wait(page, f"replay.scale === {fitted}")
        page.touchscreen.tap(*on_screen(page, "replay", *world.episode("restart")["states"][0]["cells"][1]))
        equal(text(page, "agent-name"), "Agent 1")


def test_colors_follow_the_color_scheme(world):
    with world.open("restart", color_scheme="dark") as page:
        row = world.episode("restart")["map"][0]
        at = page.evaluate("(col) => replay.center(0, col)", row.index("."))
        assert sum(pixel(page, "ground", *at)[:3]) < 150
        page.emulate_media(color_scheme="light")
        settle(page)
        equal(pixel(page, "ground", *at)[:3], [255, 255, 255], "light again")


def test_the_help_opens_and_buttons_have_names(world):
    with world.open("restart") as page:
        page.keyboard.press("?")
        assert page.locator("#help").is_visible()
        page.keyboard.press("ArrowRight")
        equal(step(page), 0, "keys do not step while the help is open")
        page.keyboard.press("Escape")
        assert page.locator("#help").is_hidden()
        check_names_of_buttons(page)
        page.focus("#first")
        page.keyboard.press("Tab")
        equal(
            page.evaluate("[document.activeElement.id, getComputedStyle(document.activeElement).outlineStyle]"),
            ["back", "solid"],
        )


def test_network_and_foreign_scripts_are_blocked(world):
    with world.open("finish") as page:
        refused = page.evaluate("fetch('http://127.0.0.1:9/').then(() => 'sent', (error) => error.name)")
        equal(refused, "TypeError")
        page.evaluate(
            "document.body.append(Object.assign(document.createElement('script'), {textContent: 'window.foreign = 1'}))"
        )
        equal(page.evaluate("window.foreign"), None, "a script that is not the page's own")
        assert len(page.errors) >= 2 and all("Content Security Policy" in one for one in page.errors), page.errors
        page.errors.clear()
        equal(
            page.evaluate("(() => { try { 'use strict'; replay.step = 3 } catch {} return replay.step })()"),
            0,
            "read only",
        )


def test_damaged_data_is_reported(world):
    source = (world.folder / "finish.html").read_text()
    head, rest = source.split('"data":"', 1)
    data, tail = rest.split('"', 1)
    path = world.scratch / "damaged.html"
    path.write_text(f'{head}"data":"{data[:40]}"{tail}')
    context = world.browser.new_context()
    page = context.new_page()
    page.goto(path.as_uri())
    page.wait_for_selector("#broken:visible")
    assert text(page, "broken").startswith("This episode cannot be shown"), text(page, "broken")
    context.close()


def test_thousand_agents_play(world):
    """`render/browser/run speed` measures the speed."""
    size = (world.folder / "large.html").stat().st_size
    assert size < 450_000, size
    with world.open("large") as page:
        page.select_option("#speed", "8")
        page.click("#play")
        first = page.evaluate("replay.numDraws")
        page.wait_for_function("first => replay.numDraws > first + 20", arg=first)
        return f"{size} bytes"


def test_an_episode_without_steps_is_shown(world):
    with world.open("empty") as page:
        for key in ("Space", "End", "ArrowRight", "]"):
            page.keyboard.press(key)
        settle(page)
        equal(text(page, "step"), "step 0 / 0")
        equal(text(page, "agent-name"), "Agent 0")
