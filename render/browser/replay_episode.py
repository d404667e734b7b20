"""The replay page shows the recorded episode."""

import random

from support import equal, on_screen, pixel, place, settle, step, text

SMALL = ["finish", "restart", "soft", "nothing"]
MOVES = [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)]
NAMES = ["stay", "up", "down", "left", "right"]
# The first agents have POGEMA's colours.
POGEMA = ["#c1433c", "#2e6f9e", "#6e81af", "#00b9c8"]


def rgb(color):
    return [int(color[at : at + 2], 16) for at in (1, 3, 5)]


def is_reverted(episode, at, agent):
    """Returns whether an agent's move in a step was reverted."""
    if at == 0:
        return False
    before, after = episode["states"][at - 1], episode["states"][at]
    return before["active"][agent] and after["actions"][agent] != 0 and before["cells"][agent] == after["cells"][agent]


def reverted(episode, agent):
    return [at for at in range(len(episode["states"])) if is_reverted(episode, at, agent)]


def expected_state(episode, at, agent):
    """Returns the state of an agent that the page must show."""
    state, states = episode["states"][at], episode["states"]
    rewards = [one["rewards"][agent] for one in states[1 : at + 1]]
    why = reason(episode, at, agent) if is_reverted(episode, at, agent) else None
    return {
        "cell": state["cells"][agent],
        "goal": state["goals"][agent],
        "isActive": state["active"][agent],
        "isOnGoal": state["on_goal"][agent],
        "isMarked": state["cells"][agent] in state["occupied"],
        "action": NAMES[state["actions"][agent]] if at else None,
        "reward": rewards[-1] if rewards else 0,
        "total": sum(rewards),
        "isTerminated": bool(at) and state["terminated"][agent],
        "isTruncated": bool(at) and state["truncated"][agent],
        "reverted": why,
    }


def reason(episode, at, agent):
    """Returns the expected reason for a reverted move."""
    recorded = next(one for one in episode["reverted"][at - 1] if one["agent"] == agent)
    state = episode["states"][at]
    action = state["actions"][agent]
    cell = [here + there for here, there in zip(state["cells"][agent], MOVES[action])]
    return {
        "step": at,
        "action": NAMES[action],
        "rule": recorded["rule"],
        "cause": recorded["cause"],
        "cell": cell,
        "other": recorded["other"],
    }


def test_every_arrival_is_in_the_strip(world):
    for name in [*SMALL, "on_goal"]:
        episode = world.episode(name)
        keeps = episode["config"]["on_goal"] == "nothing"
        flags = [state["on_goal"] for state in episode["states"]]
        arrivals = [sum(now and not (keeps and was) for was, now in zip(*pair)) for pair in zip(flags, flags[1:])]
        with world.open(name) as page:
            got = page.evaluate("Array.from({ length: replay.numSteps }, (_, step) => replay.arrivals(step + 1))")
            equal(got, arrivals, name)
    equal(arrivals[0], 1, "the agent that starts on its goal")


def test_title_and_facts_come_from_the_episode_and_are_escaped(world):
    with world.open("finish") as page:
        title = world.episode("finish")["title"]
        assert "<script>" in title
        equal(text(page, "title"), title)
        equal(page.title(), title)
        assert text(page, "metrics").startswith("· ISR "), "the metrics are apart from the facts"
        equal(
            text(page, "facts"),
            f"8 × 8 · 4 agents · {len(world.episode('finish')['states']) - 1} steps · priority · finish · radius 5",
        )


def test_states_are_those_of_the_episode(world):
    rng = random.Random(1)
    for name in [*SMALL, "large"]:
        episode = world.episode(name)
        with world.open(name) as page:
            num_steps, num_agents = len(episode["states"]) - 1, episode["config"]["num_agents"]
            equal(page.evaluate("[replay.numSteps, replay.numAgents]"), [num_steps, num_agents])
            asked = [[rng.randrange(num_steps + 1), rng.randrange(num_agents)] for _ in range(60)]
            shown = page.evaluate("(asked) => asked.map(([at, agent]) => replay.state(at, agent))", asked)
            for (at, agent), got in zip(asked, shown):
                equal(got, expected_state(episode, at, agent), f"{name} {at} {agent}")


def test_marks_are_the_occupancy_grid(world):
    for name in SMALL:
        episode = world.episode(name)
        width = len(episode["map"][0])
        with world.open(name) as page:
            shown = page.evaluate("Array.from({ length: replay.numSteps + 1 }, (_, at) => replay.marks(at))")
            expected = [sorted(row * width + col for row, col in state["occupied"]) for state in episode["states"]]
            equal(shown, expected, name)
    soft = world.episode("soft")["states"]
    assert any(len(state["occupied"]) < sum(state["active"]) for state in soft), (
        "no agent vanished, so this tested nothing"
    )


def test_windows_are_observations(world):
    for name in SMALL:
        episode = world.episode(name)
        with world.open(name) as page:
            num_agents = episode["config"]["num_agents"]
            asked = [[at, agent] for at in range(0, len(episode["states"]), 5) for agent in range(num_agents)]
            shown = page.evaluate(
                """(asked) => asked.map(([at, agent]) => {
                  const { obstacles, agents, goal } = replay.observe(at, agent);
                  return [obstacles, agents, goal].flat().map((row) => row.join("")).join("");
                })""",
                asked,
            )
            for (at, agent), got in zip(asked, shown):
                equal(got, episode["observations"][at][agent], f"{name} {at} {agent}")


def test_mouse_keys_and_search_select_an_agent(world):
    episode = world.episode("restart")
    with world.open("restart", "#step=5") as page:
        page.mouse.click(*on_screen(page, "replay", *episode["states"][5]["cells"][3]))
        settle(page)
        equal(text(page, "agent-name"), "Agent 3")
        equal(text(page, "agent-cell"), place(episode["states"][5]["cells"][3]))
        equal(text(page, "agent-goal"), place(episode["states"][5]["goals"][3]))
        equal(text(page, "agent-action"), NAMES[episode["states"][5]["actions"][3]])
        for key, expected in [("]", "Agent 4"), ("[", "Agent 3"), ("[", "Agent 2")]:
            page.keyboard.press(key)
            equal(text(page, "agent-name"), expected)
        page.keyboard.press("Escape")
        assert page.locator("#agent").is_hidden()
        page.fill("#search", "6")
        equal(page.locator("#agents .row").count(), 1)
        page.keyboard.press("Enter")
        equal(text(page, "agent-name"), "Agent 6")
        page.fill("#search", "99")
        equal(text(page, "found"), "no agent 99, expected 0 to 7")
        page.fill("#search", "")
        page.click("#agents-1")
        equal(text(page, "agent-name"), "Agent 1")
        page.focus("#agents")
        page.keyboard.press("ArrowDown")
        equal(text(page, "agent-name"), "Agent 2")
        page.select_option("#order", "reverted")
        most = max(range(8), key=lambda agent: len(reverted(episode, agent)))
        assert text(page, "agents").startswith(f"agent {most}"), text(page, "agents")


def test_a_press_on_a_row_counts_if_the_list_changes_its_size_before_the_release(world):
    with world.open("restart") as page:
        page.hover("#agents-1")
        page.mouse.down()
        page.evaluate("document.getElementById('agents').style.maxHeight = '90px'")
        settle(page)
        page.mouse.up()
        equal(text(page, "agent-name"), "Agent 1")


def test_reverted_moves_are_listed_and_lead_to_their_steps(world):
    for name in ("restart", "soft"):
        episode = world.episode(name)
        agent = max(range(episode["config"]["num_agents"]), key=lambda one: len(reverted(episode, one)))
        steps = reverted(episode, agent)
        with world.open(name, f"#agent={agent}") as page:
            equal(text(page, "moves-title"), f"{len(steps)} reverted moves")
            for index in (0, 2):
                row = page.locator(f"#moves-{index}")
                expected = reason(episode, steps[index], agent)
                shown = row.inner_text()
                assert expected["rule"] in shown and str(steps[index]) in shown and expected["action"] in shown, (
                    shown,
                    expected,
                )
                row.click()
                settle(page)
                equal(step(page), steps[index])
                equal(text(page, "why-rule"), expected["rule"])
                named = {"agent": f"agent {expected['other']}", "wall": "the wall", "obstacle": "obstacle"}[
                    expected["cause"]
                ]
                assert named in text(page, "why-text"), text(page, "why-text")
            page.keyboard.press("Home")
            settle(page)
            assert page.locator("#why").is_hidden()


def test_canvas_shows_agents_goals_and_obstacles(world):
    episode = world.episode("restart")
    with world.open("restart", "#step=20") as page:
        page.uncheck("#numbers")
        page.uncheck("#goals")
        settle(page)
        state = episode["states"][20]
        for agent, color in enumerate(POGEMA):
            at = page.evaluate("([row, col]) => replay.center(row, col)", state["cells"][agent])
            equal(pixel(page, "actors", *at), [*rgb(color), 255], f"agent {agent}")
        cells = [(row, col, episode["map"][row][col]) for row in range(12) for col in range(12)]
        for row, col, kind in cells:
            at = page.evaluate("([row, col]) => replay.center(row, col)", [row, col])
            equal(pixel(page, "ground", *at), [*rgb("#84a1ae" if kind == "#" else "#ffffff"), 255], f"{row} {col}")
            if [row, col] not in state["cells"]:
                equal(pixel(page, "actors", *at)[3], 0, f"no agent on {row} {col}")
        page.check("#goals")
        settle(page)
        free = next(
            agent
            for agent in range(4)
            if state["goals"][agent] not in state["cells"] and state["goals"].count(state["goals"][agent]) == 1
        )
        x, y = page.evaluate("([row, col]) => replay.center(row, col)", state["goals"][free])
        scale = page.evaluate("replay.scale")
        equal(pixel(page, "actors", x + 0.35 * scale, y)[:3], rgb(POGEMA[free]), "the ring of a goal")
        equal(pixel(page, "actors", x, y)[3], 0, "inside a goal")
