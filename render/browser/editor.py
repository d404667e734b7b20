"""The map editor draws, places agents and reports on the map."""

from maps import at, drag, pairs, paste, press, resize, rows, save
from support import equal, pixel, settle, text


def test_draw_erase_undo_redo(world):
    with world.open("editor") as page:
        resize(page, 4, 6, "new")
        equal(rows(page), ["......"] * 4)
        drag(page, (1, 1), (1, 4))
        drawn = ["......", ".####.", "......", "......"]
        equal(rows(page), drawn)
        place = page.evaluate("editor.center(1, 2)")
        equal(pixel(page, "ground", *place)[:3], [0x84, 0xA1, 0xAE], "an obstacle is drawn")
        page.keyboard.down("Shift")
        press(page, 1, 2)
        page.keyboard.up("Shift")
        equal(rows(page)[1], ".#.##.")
        equal(pixel(page, "ground", *place)[:3], [255, 255, 255], "and removed")
        page.click("#undo")
        equal(rows(page), drawn)
        page.keyboard.press("Control+z")
        equal(rows(page), ["......"] * 4)
        page.keyboard.press("Control+y")
        page.keyboard.press("Control+Shift+Z")
        settle(page)
        equal(rows(page)[1], ".#.##.")
        assert page.is_disabled("#redo")
        # A fast stroke has no gaps.
        page.mouse.move(*at(page, 3, 0))
        page.mouse.down()
        page.mouse.move(*at(page, 3, 5))
        page.mouse.up()
        equal(rows(page)[3], "######")


def test_rectangle_fill_and_pools(world):
    with world.open("editor") as page:
        resize(page, 5, 5, "new")
        page.click("[data-tool=rectangle]")
        drag(page, (3, 3), (1, 1))
        page.click("[data-kind='0']")
        press(page, 2, 2)
        page.click("[data-tool=fill]")
        page.click("[data-kind='2']")
        equal(page.get_attribute("[data-tool=fill]", "aria-pressed"), "true")
        press(page, 2, 2)
        equal(rows(page), [".....", ".###.", ".#@#.", ".###.", "....."])
        page.click("[data-kind='3']")
        press(page, 0, 0)
        equal(rows(page), ["$$$$$", "$###$", "$#@#$", "$###$", "$$$$$"])
        equal(text(page, "components"), "2")
        equal(text(page, "free"), "17 of 25")
        equal(text(page, "density"), "0.320")
        [read] = world.check(save(world, page, "txt"))
        equal(read["rows"], [".....", ".###.", ".#.#.", ".###.", "....."])
        equal([len(pool) for pool in read["pools"]], [1, 16])


def test_agents(world):
    with world.open("editor") as page:
        resize(page, 4, 4, "new")
        press(page, 1, 1)
        page.click("[data-tool=agents]")
        drag(page, (0, 0), (3, 3))
        press(page, 0, 2)
        assert "agent 1 has no goal yet" in text(page, "issues")
        page.click("#save-yaml")
        equal(text(page, "message"), "not saved: agent 1 has no goal yet")
        press(page, 1, 1)
        equal(pairs(page), [[[0, 0], [3, 3]], [[0, 2], [1, 1]]])
        equal(rows(page), ["...."] * 4, "a goal removes the obstacle")
        drag(page, (3, 3), (2, 0))
        drag(page, (0, 0), (0, 2))
        equal(pairs(page)[0][1], [2, 0])
        assert pairs(page)[0][0] != [0, 2], "two agents cannot share a start"
        page.click("[data-tool=brush]")
        page.click("[data-kind='1']")
        drag(page, (2, 0), (2, 3))
        equal(rows(page)[2], ".###", "no obstacle on a goal")
        page.click("[data-tool=remove]")
        press(page, 1, 1)
        equal(len(pairs(page)), 1)
        page.click("#undo")
        equal(len(pairs(page)), 2)


def test_unreachable_goals_are_flagged(world):
    with world.open("editor") as page:
        paste(page, "a.#.A\nb.#..\nB.#..\n")
        equal(page.evaluate("editor.issues"), ["agent 0 cannot reach its goal: it is in another component"])
        equal(text(page, "components"), "2")
        page.check("#tint")
        settle(page)
        one, other = (
            pixel(page, "ground", *page.evaluate("(col) => editor.center(1, col)", col))[:3] for col in (1, 3)
        )
        assert one != other and [255, 255, 255] not in (one, other), (one, other)
        page.click("#issues button")
        page.keyboard.press(".")
        press(page, 1, 2)
        equal(page.evaluate("editor.issues"), [])


def test_keyboard_only(world):
    with world.open("editor") as page:
        resize(page, 4, 4, "new")
        page.focus("#stage")
        for key in ["ArrowUp", *["ArrowUp"] * 4, *["ArrowLeft"] * 4, "Space", "ArrowRight", "Enter"]:
            page.keyboard.press(key)
        equal(rows(page), ["##..", "....", "....", "...."])
        for key in ["Delete", "r", "ArrowDown", "Space", "ArrowDown", "ArrowRight", "Space"]:
            page.keyboard.press(key)
        equal(rows(page), ["#...", ".##.", ".##.", "...."])
        for key in ["a", "ArrowDown", "Space", "ArrowRight", "Space"]:
            page.keyboard.press(key)
        equal(pairs(page), [[[3, 2], [3, 3]]])
        page.keyboard.press("Delete")
        equal(pairs(page), [])
        assert "(3, 3)" in text(page, "where")
        page.keyboard.press("?")
        assert page.locator("#help").is_visible()
        page.keyboard.press("Escape")
        unnamed = page.evaluate(
            "[...document.querySelectorAll('button')]"
            ".filter((button) => !(button.getAttribute('aria-label') || button.textContent.trim())).length"
        )
        equal(unnamed, 0, "buttons without a name")


def test_resize(world):
    with world.open("editor") as page:
        paste(page, "a.A\nb#B\n")
        resize(page, 1, 4)
        equal((rows(page), pairs(page)), (["...."], [[[0, 0], [0, 2]]]))
        assert "removed 1 agent outside it" in text(page, "message")
        page.click("#undo")
        equal((rows(page), len(pairs(page))), (["...", ".#."], 2))
        resize(page, 0, 4)
        equal(text(page, "message"), "rows and columns must be whole numbers from 1 to 4096")
        equal(rows(page), ["...", ".#."])


def test_phone(world):
    phone = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True, "device_scale_factor": 3}
    with world.open("editor", **phone) as page:
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "nothing is wider than the phone"
        page.touchscreen.tap(*at(page, 2, 3))
        settle(page)
        equal(rows(page)[2], "...#............")
        session = page.context.new_cdp_session(page)
        (x, y), before = at(page, 8, 8), page.evaluate("editor.center(0, 1)[0] - editor.center(0, 0)[0]")

        def touch(kind, *columns):
            session.send(
                "Input.dispatchTouchEvent",
                {"type": kind, "touchPoints": [{"x": column, "y": y, "id": id} for id, column in columns]},
            )

        touch("touchStart", (0, x - 30))
        touch("touchStart", (0, x - 30), (1, x + 30))
        for spread in (40, 50, 60):
            touch("touchMove", (0, x - spread), (1, x + spread))
        touch("touchEnd")
        settle(page)
        assert page.evaluate("editor.center(0, 1)[0] - editor.center(0, 0)[0]") > 1.5 * before
        equal("".join(rows(page)).count("#"), 1, "a pinch draws nothing")
