"""Plays an episode and writes a page that replays it in any browser.

    python replay_html.py --out replay.html
"""

import argparse

from pogema_rs import BatchAStarAgent, GridConfig, pogema_v0

ROOMS = """
.......#.......
.a.....#.....b.
.......#.......
...............
.......#.......
.B.....#.....A.
.......#.......
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="replay.html", metavar="FILE")
    arguments = parser.parse_args()
    env = pogema_v0(GridConfig(map=ROOMS, on_target="nothing", observation_type="POMAPF"), semantics="2.0")
    env.enable_animation()
    observations, infos = env.reset()
    team = BatchAStarAgent()
    while "metrics" not in infos[0]:
        observations, _, _, _, infos = env.step(team.act(observations))
    env.save_replay(arguments.out, title="Two agents swap rooms")
    print(f"{arguments.out}: {infos[0]['metrics']}")


if __name__ == "__main__":
    main()
