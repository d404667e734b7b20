"""Plays an episode and writes a page that replays it in any browser.

python replay_html.py --out replay.html
"""

import argparse

from typing import Any

from pogema_rs import BatchAStarAgent, GridConfig, pogema_v0
from pogema_rs.envs import Pogema

ROOMS = """
.......#.......
.a.....#.....b.
.......#.......
...............
.......#.......
.B.....#.....A.
.......#.......
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="replay.html", metavar="FILE")
    arguments = parser.parse_args()
    config = GridConfig(map=ROOMS, on_target="nothing", observation_type="POMAPF")
    env: Pogema[dict[str, Any]] = pogema_v0(config, semantics="2.0")
    env.enable_animation()
    observations, infos = env.reset()
    team = BatchAStarAgent()
    while "metrics" not in infos[0]:
        observations, _, _, _, infos = env.step(team.act(observations))
    env.save_replay(arguments.out, title="Two agents swap rooms")
    print(f"{arguments.out}: {infos[0]['metrics']}")


if __name__ == "__main__":
    main()
