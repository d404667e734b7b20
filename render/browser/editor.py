"""The map editor draws maps, places agents and reports problems."""

from editor_support import at, click_cell, drag, drop, pairs, paste, resize, rows, save, yaml_of
from support import PHONE, check_names_of_buttons, equal, pixel, settle, stage, text, touches


def test_strokes_draw_and_erase_and_can_be_undone(world):
    with world.open("editor") as page:
        resize(page, 4, 6, "new")
        equal(rows(page), ["......"] * 4)
        drag(page, (1, 1), (1, 4))
        drawn = ["......", ".####.", "......", "......"]
        equal(rows(page), drawn)
        place = page.evaluate("editor.center(1, 2)")
        equal(pixel(page, "ground", *place)[:3], [0x84, 0xA1, 0xAE], "an obstacle is drawn")
        page.keyboard.down("Shift")
        click_cell(page, 1, 2)
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


def test_rectangles_fills_and_pools_change_the_map(world):
    with world.open("editor") as page:
        resize(page, 5, 5, "new")
        page.click("[data-tool=rectangle]")
        drag(page, (3, 3), (1, 1))
        page.click("[data-kind='0']")
        click_cell(page, 2, 2)
        page.click("[data-tool=fill]")
        page.click("[data-kind='2']")
        equal(page.get_attribute("[data-tool=fill]", "aria-pressed"), "true")
        click_cell(page, 2, 2)
        equal(rows(page), [".....", ".###.", ".#@#.", ".###.", "....."])
        page.click("[data-kind='3']")
        click_cell(page, 0, 0)
        equal(rows(page), ["$$$$$", "$###$", "$#@#$", "$###$", "$$$$$"])
        equal(text(page, "components"), "2")
        equal(text(page, "free"), "17 of 25")
        equal(text(page, "density"), "0.320")
        [read] = world.check(save(world, page, "txt"))
        equal(read["rows"], [".....", ".###.", ".#.#.", ".###.", "....."])
        equal([len(pool) for pool in read["pools"]], [1, 16])


def test_agents_get_starts_and_goals_on_free_cells(world):
    with world.open("editor") as page:
        resize(page, 4, 4, "new")
        click_cell(page, 1, 1)
        page.click("[data-tool=agents]")
        drag(page, (0, 0), (3, 3))
        equal(rows(page)[1], ".#..", "a drag keeps the obstacles below it")
        click_cell(page, 0, 2)
        assert "agent 1 has no goal yet" in text(page, "issues")
        page.click("#save-yaml")
        equal(text(page, "message"), "not saved: agent 1 has no goal yet")
        click_cell(page, 1, 1)
        equal(pairs(page), [[[0, 0], [3, 3]], [[0, 2], [1, 1]]])
        equal(rows(page), ["...."] * 4, "a goal removes the obstacle")
        drag(page, (3, 3), (2, 0))
        drag(page, (0, 0), (0, 2))
        equal(pairs(page)[0][1], [2, 0])
        assert pairs(page)[0][0] != [0, 2], "two agents share a start"
        page.click("[data-tool=brush]")
        page.click("[data-kind='1']")
        drag(page, (2, 0), (2, 3))
        equal(rows(page)[2], ".###", "no obstacle on a goal")
        page.click("[data-tool=remove]")
        click_cell(page, 1, 1)
        equal(len(pairs(page)), 1)
        page.click("#undo")
        equal(len(pairs(page)), 2)


def test_a_dragged_agent_removes_only_the_last_obstacle(world):
    with world.open("editor") as page:
        paste(page, ".....\n.###.\n.....\n")
        page.click("[data-tool=agents]")
        drag(page, (1, 0), (1, 4))
        equal((rows(page), pairs(page)), ([".....", ".###.", "....."], [[[1, 0], [1, 4]]]))
        drag(page, (1, 0), (1, 2))
        equal((rows(page)[1], pairs(page)), (".#.#.", [[[1, 2], [1, 4]]]))
        page.click("#undo")
        equal(rows(page)[1], ".###.")


def test_only_escape_acts_during_a_stroke(world):
    with world.open("editor") as page:
        resize(page, 4, 4, "new")

        def stroke(keys, *cells):
            page.mouse.move(*at(page, *cells[0]))
            page.mouse.down()
            for cell in cells[1:-1]:
                page.mouse.move(*at(page, *cell))
            for key in keys:
                page.keyboard.press(key)
            page.mouse.move(*at(page, *cells[-1]))
            page.mouse.up()
            settle(page)

        stroke("r", (0, 0), (0, 1), (0, 1))
        equal(rows(page), ["##..", "....", "....", "...."], "a line, not a rectangle")
        stroke("a", (1, 0), (1, 0), (1, 2))
        equal((rows(page)[1], pairs(page)), ("###.", []))
        stroke(["Escape"], (3, 0), (3, 1), (3, 3))
        equal(rows(page)[3], "....", "the stroke is cancelled")
        page.click("[data-tool=agents]")
        stroke(["Control+z"], (2, 0), (2, 0), (2, 3))
        equal(pairs(page), [[[2, 0], [2, 3]]])


def test_later_goals(world):
    config = "map: |\n  ..#.\nagents_xy: [[0, 0]]\ntargets_xy: [[[0, 1], [0, 3]]]\non_target: restart\n"
    with world.open("editor") as page:
        paste(page, config)
        reason = "agent 0 cannot reach its goal (0, 3): it is in another component"
        equal(page.evaluate("editor.issues"), [reason])
        x, y = page.evaluate("editor.center(0, 3)")
        radius = 0.175 * (page.evaluate("editor.center(0, 1)[0] - editor.center(0, 0)[0]"))
        equal(pixel(page, "actors", x + radius, y)[:3], [0xC1, 0x43, 0x3C], "the later goal is drawn")
        click_cell(page, 0, 3)
        equal(rows(page), ["..#."], "no obstacle on a later goal")
        page.mouse.move(*at(page, 0, 3))
        equal(text(page, "where"), "(0, 3) later goal of agent 0")
        resize(page, 1, 3)
        equal(text(page, "message"), "resized the map to 1 × 3; removed 1 later goal outside it")
        paste(page, "map: |\n  ..#.\nagents_xy: [[0, 0]]\ntargets_xy: [[[0, 1], [0, 2]]]\n")
        page.click("[data-tool=agents]")
        drag(page, (0, 1), (0, 0))
        equal(
            page.evaluate("editor.issues"),
            [
                "agent 0 has its goal (0, 2) on an obstacle",
            ],
        )
        paste(page, "map: |\n  ...\n  ...\nagents_xy: [[0, 0]]\ntargets_xy: [[[0, 1], [0, 2]]]\n")
        drag(page, (1, 0), (1, 2))
        equal(
            page.evaluate("editor.issues"),
            ["agents have sequences of goals, expected at least two goals for each agent"],
        )


def test_large_maps(world):
    with world.open("editor") as page:
        resize(page, 1, 4096, "new")
        for col in (0, 4095):
            assert 0 < page.evaluate("(col) => editor.center(0, col)[0]", col) < stage(page)["width"], col
        sides = range(128)
        agents, goals = [[[row, col] for row in sides for col in cols] for cols in ((0, 1), (126, 127))]
        config = "map: |\n" + ("  " + "." * 128 + "\n") * 128 + f"agents_xy: {agents}\ntargets_xy: {goals}\n"
        drop(page, "large.yaml", config)
        page.click("[data-tool=fill]")
        click_cell(page, 64, 64)
        equal(text(page, "free"), "512 of 16,384")
        page.click("[data-tool=rectangle]")
        page.click("[data-kind='0']")
        drag(page, (127, 127), (0, 0))
        equal(text(page, "components"), "1")


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
        click_cell(page, 1, 2)
        equal(page.evaluate("editor.issues"), [])


def test_the_keyboard_alone_edits_the_map(world):
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
        check_names_of_buttons(page)


def test_a_resize_removes_agents_outside_and_can_be_undone(world):
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


def test_a_cursor_outside_a_smaller_map_is_removed(world):
    with world.open("editor") as page:
        resize(page, 32, 32, "new")
        page.focus("#stage")
        for key in ["ArrowDown", *["Shift+ArrowDown"] * 4, *["Shift+ArrowRight"] * 4, "Control+z", "a", "Space"]:
            page.keyboard.press(key)
        settle(page)
        equal((len(rows(page)), pairs(page)), (16, []))


def test_undo_restores_the_config_and_edits_without_effect_keep_redo(world):
    with world.open("editor") as page:
        config = "map: |-\n  ....\nnum_agents: 1\nagents_xy: [[0, 0], [0, 1]]\ntargets_xy: [[0, 2], [0, 3]]\n"
        paste(page, config)
        resize(page, 3, 3, "new")
        page.click("#undo")
        equal(yaml_of(page), config, "undo restores the number of listed agents")
        click_cell(page, 0, 0)
        page.click("[data-tool=remove]")
        click_cell(page, 0, 2)
        page.click("#undo")
        resize(page, 1, 4)
        page.click("[data-tool=agents]")
        click_cell(page, 0, 1)
        page.click("#redo")
        equal(len(pairs(page)), 1, "edits without effect keep redo")


def test_shortcuts_do_not_change_the_map_behind_a_dialog(world):
    with world.open("editor") as page:
        click_cell(page, 0, 0)
        page.check("#tint")
        page.keyboard.press("Control+z")
        equal(rows(page)[0][0], ".", "undo with the focus on a checkbox")
        page.keyboard.press("Control+y")
        page.click("#edit-source")
        page.click("#source-as-text")
        page.keyboard.press("Control+z")
        paste(page, "...")
        equal(rows(page)[0], "#" + "." * 15, "the map behind the dialog stays")
        page.click("#source-close")
        page.evaluate("dispatchEvent(new KeyboardEvent('keydown', { key: '@', altKey: true }))")
        click_cell(page, 0, 1)
        equal(rows(page)[0][:3], "#@.", "a character that needs alt")


def test_phone(world):
    with world.open("editor", **PHONE) as page:
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "nothing is wider than the phone"
        page.touchscreen.tap(*at(page, 2, 3))
        settle(page)
        equal(rows(page)[2], "...#............")
        page.touchscreen.tap(*at(page, 4, 3))
        page.tap("#undo")
        touch = touches(page)
        (x, y), before = at(page, 8, 8), page.evaluate("editor.center(0, 1)[0] - editor.center(0, 0)[0]")
        touch("touchStart", (0, x - 30, y))
        touch("touchStart", (0, x - 30, y), (1, x + 30, y))
        for spread in (40, 50, 60):
            touch("touchMove", (0, x - spread, y), (1, x + spread, y))
        touch("touchEnd")
        settle(page)
        assert page.evaluate("editor.center(0, 1)[0] - editor.center(0, 0)[0]") > 1.5 * before
        equal("".join(rows(page)).count("#"), 1, "a pinch draws nothing")
        page.tap("#redo")
        equal("".join(rows(page)).count("#"), 2, "a pinch keeps redo")
