"""Times POGEMA's own placement: SIDE AGENTS REPEATS on the command line, the best time in seconds on stdout."""

import sys
import time

from pogema import GridConfig
from pogema.grid import Grid

side, num_agents, repeats = map(int, sys.argv[1:])
config = GridConfig(size=side, density=0.3, num_agents=num_agents, seed=0)
best = float("inf")
for _ in range(repeats):
    start = time.perf_counter()
    Grid(config)
    best = min(best, time.perf_counter() - start)
print(best)
