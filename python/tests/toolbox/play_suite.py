"""Plays a suite with policies in Python: play_suite.py SUITE FOLDER BEGIN [ADDRESS [PAGE]]"""

import os
import signal
import sys
import time
from pathlib import Path

from pogema_rs import BatchAStarAgent
from pogema_rs.toolbox.algorithm_config import AlgoBase
from pogema_rs.toolbox.evaluator import EvaluationError, evaluation
from pogema_rs.toolbox.registry import ToolboxRegistry


class SlowConfig(AlgoBase):
    """Settings of `Slow`."""

    seconds: float = 0.0


class Slow(BatchAStarAgent):
    """POGEMA's A* with a delay in each step."""

    def __init__(self, config):
        super().__init__()
        self.seconds = config.seconds

    def act(self, observations):
        """Sleeps, then returns the actions of A*."""
        time.sleep(self.seconds)
        return super().act(observations)


class MortalConfig(AlgoBase):
    """Settings of `Mortal`: the file that marks the death of a process."""

    mark: str


class Mortal(BatchAStarAgent):
    """POGEMA's A*, whose first process kills itself."""

    def __init__(self, config):
        super().__init__()
        self.mark = Path(config.mark)

    def act(self, observations):
        """Kills its process, or returns the actions of A*."""
        if not self.mark.exists():
            self.mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().act(observations)


class ForkingConfig(AlgoBase):
    """Settings of `Forking`: the file for the process id."""

    pid: str


class Forking(BatchAStarAgent):
    """POGEMA's A*, which forks a process that sleeps."""

    def __init__(self, config):
        super().__init__()
        pid = Path(config.pid)
        if not pid.exists():
            child = os.fork()
            if child == 0:
                os.closerange(0, 3)
                time.sleep(600)
                os._exit(0)
            pid.write_text(str(child))


class Crowded:
    """A policy that stays, and fails with more than 6 agents."""

    def reset_states(self):
        """Does nothing."""

    def act(self, observations):
        """Returns the action to stay for each agent."""
        if len(observations) > 6:
            raise ValueError(f"{len(observations)} are\ntoo many")
        return [0] * len(observations)


def register():
    """Registers the policies and a map."""
    ToolboxRegistry.register_algorithm("Slow", Slow, SlowConfig)
    ToolboxRegistry.register_algorithm("Mortal", Mortal, MortalConfig)
    ToolboxRegistry.register_algorithm("Forking", Forking, ForkingConfig)
    ToolboxRegistry.register_algorithm("Crowded", Crowded)
    ToolboxRegistry.register_maps({"hall": [[0] * 9 for _ in range(9)]})


def main():
    suite, folder, begin, *more = sys.argv[1:]
    address, page = (*more, "", "")[:2]
    ToolboxRegistry.setup_logger("INFO")
    register()
    try:
        results = evaluation(suite, folder, begin=begin, dask=address or None, html=page or None)
    except (EvaluationError, ValueError, OSError) as error:
        sys.exit(f"{type(error).__name__}: {error}")
    print(len(results))


if __name__ == "__main__":
    main()
