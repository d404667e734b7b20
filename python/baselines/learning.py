"""Trains each method for a minute and tests what it reaches; not collected by default, see `./check training`."""

import csv

import pytest
from pogema_rs.baselines import METHODS, Budget, train
from small import small_config

#: The goal mode, the metric and the required value of each method, on maps of 5x5 cells with two agents.
#: At the first validation, after 10 iterations, the methods reach an ISR of 0.5 to 0.7, and Follower a throughput of
#: 0.22. Follower is only rewarded for following its path, so it needs a next goal.
AIMS = dict.fromkeys(METHODS, ("finish", "ISR", 0.9)) | {
    "epom": ("finish", "ISR", 0.8),
    "follower": ("restart", "avg_throughput", 0.4),
    "follower-small": ("restart", "avg_throughput", 0.4),
    "follower-large": ("restart", "avg_throughput", 0.4),
    # EPOM alone reaches 0.36 and RePlan alone 0.44, so the network must prefer RePlan.
    "lswitcher": ("restart", "avg_throughput", 0.4),
}


@pytest.mark.parametrize("method", METHODS)
def test_one_minute_of_training_reaches_the_required_value(method, tmp_path):
    on_target, metric, least = AIMS[method]
    changes = [f"environment.on_target=[{on_target}]", "environment.max_episode_steps=24", "schedule.lanes=16"]
    validation = ["schedule.validation_steps=32", "schedule.validation_episodes=128", "schedule.validate_every=10"]
    sizes = ["schedule.checkpoint_every=100"]
    if small_config(method).network.hidden:
        sizes.append("network.hidden=64")
    if "replay" in small_config(method).to_dict()["learner"]:
        sizes += ["learner.replay=1000", "learner.batch=16", "learner.updates=4", "learner.epsilon_steps=5000"]
    config = small_config(method, *changes, *validation, *sizes)
    train(config, tmp_path, Budget(minutes=1))
    rows = list(csv.DictReader((tmp_path / "curve.csv").open(newline="")))
    best = max(float(row[metric]) for row in rows)
    print(f"{method}: {metric} {best:.3f} after {rows[-1]['iteration']} iterations")
    assert best >= least
