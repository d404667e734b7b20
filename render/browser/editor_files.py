"""The map editor saves maps that the Rust side reads back unchanged, and reports errors in files."""

import random

from editor_support import (
    asks_before_closing,
    click_cell,
    drag,
    drop,
    drop_without_waiting,
    load,
    pairs,
    paste,
    pick,
    resize,
    rows,
    save,
    wait_until_loaded,
    yaml_of,
)
from support import equal, text, wait

SETTINGS = """# a comment
seed: 9007199254740993
collision_system: soft   # kept with this comment
on_target: finish

map: |
  ..#.
  .#..
  ....
obs_radius: 3
agents_xy: [[0, 0],
  [2, 3]] # two agents
targets_xy:
  - [2, 0]
  - [0, 3]
num_agents: 2
# the end
"""


FIELD = "expected a comment or a field such as map:"
END_OF_LINE = "expected the end of the line"


def test_text_is_saved_unchanged(world):
    content = "a.#b\nB..A\n.#.."
    with world.open("editor") as page:
        source = load(world, page, "small.txt", content)
        equal(text(page, "message"), "small.txt: 3 × 4, 2 agents")
        saved = save(world, page, "txt")
        equal(saved.read_text(), content + "\n")
        equal(*world.check(source, saved))
        pick(page, saved)
        equal(save(world, page, "txt").read_bytes(), saved.read_bytes(), "saved again")
        [read] = world.check(save(world, page, "yaml"))
        equal([read["agents"], read["goals"]], [[[0, 0], [0, 3]], [[1, 3], [1, 0]]])


def test_yaml_keeps_fields_that_are_not_edited(world):
    with world.open("editor") as page:
        source = load(world, page, "settings.yaml", SETTINGS)
        equal(pairs(page), [[[0, 0], [2, 0]], [[2, 3], [0, 3]]])
        saved = save(world, page, "yaml")
        before, after = world.check(source, saved)
        equal(after, before)
        for line in SETTINGS.splitlines():
            if line.startswith(("#", "seed", "coll", "on_", "obs", "num")):
                assert line in saved.read_text().splitlines(), line
        page.keyboard.press("b")
        click_cell(page, 2, 1)
        page.click("[data-tool=agents]")
        drag(page, (1, 3), (1, 2))
        changed = save(world, page, "yaml")
        [read] = world.check(changed)
        equal(read["rows"], ["..#.", ".#..", ".#.."])
        equal([read["agents"], read["goals"]], [[[0, 0], [2, 3], [1, 3]], [[2, 0], [0, 3], [1, 2]]])
        equal(
            [read["fields"][name] for name in ("seed", "obs_radius", "collision_system", "num_agents")],
            [9007199254740993, 3, "soft", 3],
        )
        pick(page, changed)
        equal(save(world, page, "yaml").read_bytes(), changed.read_bytes(), "saved again")


def test_all_notations_of_a_config_are_read_alike(world):
    same = [
        'map: "a.#\\n..A"\nseed: 1\n',
        "seed: 1\nmap: a.# ..A\n",
        "seed: 1\nmap: >-\n  a.#\n\n  ..A\n",
        "seed: 1\nmap: [[0, 0, 1], [0, 0, 0]]\nagents_xy: [[0,0]]\ntargets_xy: [[1,2]]\n",
        "---\nmap:\n  - [0, 0, 1]\n  - [0, 0, 0]\nagents_xy:\n- [0,0] # here\ntargets_xy:\n- [1,2]\nseed: 1",
        "seed: 1\nagents_xy:\n  - [0, 0]\n# x\n\n  - [1, 1]\ntargets_xy:\n# y\n  - [1, 2]\n  - [0, 1]\nmap: ... ...\n",
        "seed: 1\nmap:\n  - [0, 0, 1]\n# middle\n  - [0, 0, 0]\nagents_xy: [[0,0]]\ntargets_xy: [\n# x\n  [1,2]\n]\n",
        "map: a.A #..\n  #...\nseed: 1\n",
        "map: a.A\n  ...\n\n  #...\nseed: 1\n",
        'seed: 1\nmap: "a.#\\n..A"  # comment\n',
        "seed: 1\nmap: 'a.# ..A' # it's a map\n",
        'seed: 1\nmap: "\n  a.A\n  ..."\n',
        "map: |\n      a.A\n      #..\n\n   # a comment\nseed: 1\n",
        "map: |2\n    a.A\n    ..#\n # #\nseed: 1\n",
        '{"map": "a.#\\n..A", "seed": 1}',
        '{\n "seed": 1, "map": [[0,0,1],[0,0,0]], "agents_xy": [[0,0]], "targets_xy": [[1,2]]}',
    ]
    with world.open("editor") as page:
        for number, content in enumerate(same):
            source = load(world, page, f"way-{number}.yaml", content)
            before, after = world.check(source, save(world, page, "yaml"))
            equal(after, before, content)
            equal(after["fields"]["seed"], 1)


def test_yaml_keeps_blank_lines_and_comments(world):
    before = "agents_xy: [[0,0]]\n\n# b\ntargets_xy: [[0,1]]\n\nmap: |-\n    ...\n  # c\n\nseed: 1\n"
    after = "agents_xy: [[0, 0]]\n\n# b\ntargets_xy: [[0, 1]]\n\nmap: |-\n  ...\n# c\n\nseed: 1\n"
    with world.open("editor") as page:
        paste(page, before)
        equal(yaml_of(page), after)
        paste(page, "---\nmap: ...\n# end\n...\n# later\n")
        page.click("[data-tool=agents]")
        drag(page, (0, 0), (0, 2))
        equal(
            yaml_of(page),
            "---\nmap: |-\n  ...\n# end\nagents_xy: [[0, 0]]\ntargets_xy: [[0, 2]]\n...\n# later\n",
        )


def test_goal_sequences_are_kept(world):
    content = "on_target: restart\nmap: |-\n  ...\nagents_xy: [[0, 0]]\ntargets_xy: [[[0, 1], [0, 2]]]\n"
    with world.open("editor") as page:
        source = load(world, page, "restart.yaml", content)
        saved = save(world, page, "yaml")
        equal(saved.read_text(), content)
        equal(*world.check(source, saved))
        page.click("#save-text")
        equal(text(page, "message"), "not saved: text has only one goal for each agent; save it as YAML")
        page.click("[data-tool=agents]")
        paste(page, "on_target: restart\nmap: |\n  a.A\n")
        equal(page.evaluate("editor.issues"), ["on_target is restart, expected at least two goals for each agent"])
        paste(page, "on_target:\n  'restart'\nmap: |\n  a.A\n")
        equal(page.evaluate("editor.issues"), ["on_target is restart, expected at least two goals for each agent"])
        paste(page, "on_target: finish # not restart\nmap: |\n  a.A\n")
        equal(page.evaluate("editor.issues"), [])


def test_maps_that_text_cannot_represent_are_saved_only_as_yaml(world):
    shared = "map: |\n  ....\nagents_xy: [[0, 0], [0, 1]]\ntargets_xy: [[0, 3], [0, 3]]\n"
    many = (
        "map: |\n"
        + "  ....\n" * 14
        + f"agents_xy: {[[row, 0] for row in range(14)] + [[row, 1] for row in range(13)]}\n"
    )
    many += f"targets_xy: {[[row, 2] for row in range(14)] + [[row, 3] for row in range(13)]}\n"
    with world.open("editor") as page:
        for content, reason in [
            (shared, "text has one letter for each cell, but (0, 3) needs two (agent 1); save it as YAML"),
            (many, "text has letters for 26 agents, but the map has 27; save it as YAML"),
        ]:
            paste(page, content)
            page.click("#save-text")
            equal(text(page, "message"), f"not saved: {reason}")
            [read] = world.check(save(world, page, "yaml"))
            equal([list(pair) for pair in zip(read["agents"], read["goals"])], pairs(page))


def test_errors_are_reported_with_line_and_column(world):
    cases = [
        ("bad.txt", "..\n.x.\n.%", "bad.txt: line 2, column 3"),
        ("bad.txt", "...\n.?.", 'bad.txt: line 2, column 2: unknown character "?", expected one of .#@$!, a-z or A-Z'),
        ("bad.txt", "...\n..", "bad.txt: line 2, column 3: the row has 2 cells, expected 3 as in the first row"),
        (
            "bad.txt",
            "a..\n.A.\n..b",
            "bad.txt: line 3, column 3: the map has 2 starts (a-z) and 1 goal (A-Z), expected equal numbers",
        ),
        (
            "bad.txt",
            "a.A\n.@.",
            "bad.txt: line 2, column 2: the map has letters and one of @$!, expected either exact or possible starts "
            "and goals",
        ),
        ("bad.txt", " \n\n", "bad.txt: line 1, column 1: the map has no cell, expected some of .#@$!, a-z and A-Z"),
        ("bad.yaml", "seed: 1\n", "bad.yaml: line 1, column 1: the config has no map, expected the field map"),
        (
            "bad.yaml",
            "seed: 1\nmap: |\n  ..\n  .*\n",
            'bad.yaml: line 4, column 4: unknown character "*", expected one of .#@$!, a-z or A-Z',
        ),
        ("bad.yaml", "map: |\n  ..\nseed: 1\nmap: |\n  ..\n", 'bad.yaml: line 4, column 1: duplicate key "map"'),
        (
            "bad.yaml",
            "map: |\n  ..\nagents_xy: [[0, 0]]\n",
            "bad.yaml: line 3, column 1: found agents_xy without targets_xy, expected both",
        ),
        (
            "bad.yaml",
            "map: |\n  ..\nagents_xy: [[0, 0]]\ntargets_xy: [[0, 2]]\n",
            "bad.yaml: line 4, column 13: targets_xy has (0, 2), which is outside the map of 1 row and 2 columns",
        ),
        (
            "bad.yaml",
            "map: |\n  ..\nagents_xy: [[0, 0]]\ntargets_xy: [[0, x]]\n",
            "bad.yaml: line 4, column 13: targets_xy cannot be read, expected a list of [row, col]",
        ),
        (
            "bad.yaml",
            'map: "..?"\n',
            'bad.yaml: line 1, column 9: unknown character "?", expected one of .#@$!, a-z or A-Z',
        ),
        (
            "bad.yaml",
            'map: "..\\n.?"\n',
            'bad.yaml: line 1, column 6: unknown character "?", expected one of .#@$!, a-z or A-Z',
        ),
        (
            "bad.yaml",
            "map: |\n  ..\nno field\n",
            f"bad.yaml: line 3, column 1: {FIELD}",
        ),
        (
            "bad.json",
            '{"map": "..", "seed": 9007199254740993}',
            "bad.json: line 1, column 1: seed has too many digits to be read exactly from JSON, expected a config in "
            "YAML",
        ),
        (
            "bad.json",
            '{"map": "..",\n "seed" 1}',
            "bad.json: line 2, column 9: invalid JSON; a config in braces must be JSON, because this page does not "
            "read YAML in braces",
        ),
        ("bad.json", '{"map": "..",\n "seed": 1, "seed": 2}', 'bad.json: line 2, column 13: duplicate key "seed"'),
        (
            "bad.json",
            '{"map": "..", "possible_agents_xy": [[9007199254740993, 0]]}',
            "bad.json: line 1, column 1: possible_agents_xy has too many digits to be read exactly from JSON, expected "
            "a config in YAML",
        ),
        ("bad.yaml", "map: ..\nseed: [1\n", "bad.yaml: line 2, column 7: `[` is never closed"),
        ("bad.yaml", "map: ..\na: 'b\nseed: 1\n", "bad.yaml: line 2, column 4: `'` is never closed"),
        (
            "bad.yaml",
            "map: []\n",
            "bad.yaml: line 1, column 6: the map has no cell, expected a list of rows of 0 and 1",
        ),
        (
            "bad.yaml",
            "map:\n- [0, 1]\n- [0]\n",
            "bad.yaml: line 1, column 6: row 1 of the map is invalid, expected a list of 0 and 1 as long as the first "
            "row",
        ),
        ("bad.yaml", "map: ..\nseed: [1}\n", 'bad.yaml: line 2, column 9: unexpected "}", expected "]"'),
        ("bad.yaml", "map: ..\nseed: [1] 2\n", f"bad.yaml: line 2, column 10: {END_OF_LINE} after the value"),
        ("bad.yaml", "map: | ..\n", f"bad.yaml: line 1, column 7: {END_OF_LINE} after `|`"),
        ("bad.yaml", "map: ..\nseed: 1\n- 3\n", f"bad.yaml: line 3, column 1: {FIELD}"),
        ("bad.yaml", "map: ..\nseed: 1\n  foo: 2\n", f"bad.yaml: line 3, column 3: {FIELD}"),
        (
            "bad.yaml",
            "map: ..\na: b: 2\n",
            'bad.yaml: line 2, column 5: unexpected ":", expected quotes around the value',
        ),
        ("bad.yaml", "map: |\n  a.A\n# x\n  ..#\n", f"bad.yaml: line 4, column 3: {FIELD}"),
        ("bad.yaml", "map: a.A # x\n  ..#\n", f"bad.yaml: line 2, column 3: {FIELD}"),
        ("bad.yaml", "map: ..\n---\nseed: 1\n", "bad.yaml: line 2, column 1: found a second document, expected one"),
        ("bad.yaml", "map:\n- [0]\n---\n", "bad.yaml: line 3, column 1: found a second document, expected one"),
        ("bad.yaml", "map: ..\na:\n  - 1\n- 2\n", f"bad.yaml: line 4, column 1: {FIELD}"),
        ("bad.yaml", "map: ..\n...\nseed: 1\n", "bad.yaml: line 3, column 1: found a second document, expected one"),
        (
            "bad.yaml",
            "map: |\n\ta.A\n",
            "bad.yaml: line 2, column 1: unexpected tab, expected spaces at the beginning of the line",
        ),
        (
            "bad.yaml",
            "map: ..\nagents_xy: [[0.0, 0]]\ntargets_xy: [[0, 1]]\n",
            "bad.yaml: line 2, column 12: agents_xy has 0.0, expected whole numbers",
        ),
        (
            "bad.map",
            "type octile\nheight 2\nwidth 3\nmap\n.@.\n...\n",
            "bad.map: line 1, column 1: a MovingAI map, expected map text or a config; `pogema maps export MAP --to "
            "text` converts it",
        ),
    ]
    with world.open("editor") as page:
        load(world, page, "good.txt", "a.A\n")
        for name, content, expected in cases:
            load(world, page, name, content)
            got = text(page, "message")
            assert got == expected or (expected.endswith("column 3") and got.startswith(expected)), (
                content,
                got,
                expected,
            )
            equal(page.get_attribute("#message", "class"), "bad")
            equal(rows(page), ["..."], "the map stays unchanged")
        page.click("#edit-source")
        page.fill("#source-text", "..\n.?")
        page.click("#source-load")
        assert "line 2, column 2" in text(page, "source-error")
        equal(page.evaluate("[document.activeElement.selectionStart, document.activeElement.selectionEnd]"), [4, 5])
        page.fill("#source-text", "..\n.#")
        page.click("#source-load")
        assert page.locator("#source").is_hidden()
        equal(rows(page), ["..", ".#"])


def test_the_last_dropped_file_is_loaded_and_an_unreadable_one_is_reported(world):
    with world.open("editor") as page:
        page.evaluate(
            """() => {
              const text = Blob.prototype.text;
              Blob.prototype.text = async function () {
                if (this.name === "gone.txt") throw new DOMException("gone", "NotFoundError");
                if (this.name === "slow.txt") await new Promise((done) => { window.release = done; });
                return text.call(this).finally(() => { window.numRead = (window.numRead ?? 0) + 1; });
              };
            }"""
        )
        drop_without_waiting(page, "slow.txt", "....")
        drop(page, "quick.txt", "..")
        page.evaluate("window.release()")
        wait(page, "window.numRead === 2")
        wait_until_loaded(page)
        equal(rows(page), [".."], "the file dropped last is loaded")
        drop(page, "gone.txt", "...")
        equal(text(page, "message"), "gone.txt: cannot be read")
        equal(rows(page), [".."])


def test_dropped_and_pasted_maps_are_loaded(world):
    with world.open("editor") as page:
        drop(page, "dropped.txt", "a#\n.A\n")
        equal((rows(page), pairs(page)), ([".#", ".."], [[[0, 0], [1, 1]]]))
        drop(page, "dropped.yaml", "map: |\n  ...\nseed: 3\n")
        equal(rows(page), ["..."])
        assert "seed: 3" in save(world, page, "yaml").read_text()
        paste(page, "##\n..\n")
        equal(rows(page), ["##", ".."])


def test_the_page_asks_before_unsaved_maps_are_lost(world):
    with world.open("editor") as page:
        assert not asks_before_closing(page)
        page.click("[data-tool=agents]")
        click_cell(page, 0, 0)
        page.click("#save-yaml")
        assert asks_before_closing(page), "the save was refused"
        click_cell(page, 0, 1)
        save(world, page, "yaml")
        assert not asks_before_closing(page), "saved"
        page.click("#undo")
        page.click("[data-tool=brush]")
        click_cell(page, 3, 3)
        assert asks_before_closing(page), "a different map with as many edits as the saved map"
        drop(page, "other.txt", "...")
        assert not asks_before_closing(page), "the map of a file"
        click_cell(page, 0, 0)
        assert asks_before_closing(page)
        page.click("#undo")
        assert not asks_before_closing(page)
        paste(page, "....")
        assert asks_before_closing(page), "a pasted map is not in a file"


def test_undo_restores_map_and_file_name_from_before_a_load(world):
    with world.open("editor") as page:
        load(world, page, "big.yaml", "map: ...\nseed: 1\n")
        click_cell(page, 0, 0)
        drop(page, "other.txt", "..")
        equal(rows(page), [".."])
        page.click("#undo")
        equal(rows(page), ["#.."])
        equal(yaml_of(page), "map: |-\n  #..\nseed: 1\n")
        with page.expect_download() as download:
            page.click("#save-yaml")
        equal(download.value.suggested_filename, "big.yaml")
        resize(page, 2, 2, "new")
        with page.expect_download() as download:
            page.click("#save-text")
        equal(download.value.suggested_filename, "map.txt", "a new map has no file")


def test_the_dialog_never_shows_another_map(world):
    with world.open("editor") as page:
        paste(page, "a.A\n")
        page.click("#edit-source")
        page.click("#source-close")
        paste(page, "...\n...\n")
        page.click("[data-tool=agents]")
        click_cell(page, 0, 0)
        page.click("#edit-source")
        reason = "cannot be written as YAML: agent 0 has no goal yet"
        equal((page.input_value("#source-text"), text(page, "source-error")), ("", reason))
        page.click("#source-as-text")
        equal(text(page, "source-error"), "cannot be written as text: agent 0 has no goal yet")
        page.click("#source-close")
        click_cell(page, 0, 2)
        page.click("#edit-source")
        equal(text(page, "source-error"), "")
        assert "targets_xy: [[0, 2]]" in page.input_value("#source-text")


def random_map(rng, has_pools):
    height, width = rng.randint(1, 12), rng.randint(2, 12)
    lines = [[rng.choice(".#@$!" if has_pools else "..#") for _ in range(width)] for _ in range(height)]
    if has_pools:
        lines[0][:2] = "@$"
    else:
        places = [(row, col) for row in range(height) for col in range(width)]
        for index, (row, col) in enumerate(rng.sample(places, 2 * rng.randint(1, min(26, len(places) // 2)))):
            lines[row][col] = chr((65 if index % 2 else 97) + index // 2)
    return "".join("".join(line) + "\n" for line in lines)


def test_random_maps_are_read_back_unchanged(world):
    rng = random.Random(2)
    files = []
    # Chromium limits the downloads of one page, see `save`.
    for begin in range(0, 12, 4):
        with world.open("editor") as page:
            for number in range(begin, begin + 4):
                content = random_map(rng, number % 3 == 0)
                source = load(world, page, f"random-{number}.txt", content)
                text_file, yaml_file = save(world, page, "txt"), save(world, page, "yaml")
                equal(text_file.read_text(), content)
                files.append((source, text_file, yaml_file))
    read = iter(world.check(*(path for three in files for path in three)))
    for source, text_file, yaml_file in zip(read, read, read):
        equal(text_file, source)
        equal([yaml_file["rows"], yaml_file["pools"]], [source["rows"], source["pools"]])
        if source["agents"]:
            equal([yaml_file["agents"], yaml_file["goals"]], [source["agents"], source["goals"]])
