"""A small suite and a policy for the tests of evaluations."""

SUITE = {
    "environment": {
        "name": "Environment",
        "on_target": "nothing",
        "num_agents": {"grid_search": [2, 3]},
        "seed": {"grid_search": [0, 1]},
        "max_episode_steps": 8,
    },
    "algorithms": {"Policy": {"name": "Policy", "parallel_backend": "sequential"}},
}


class Still:
    """A policy that stays."""

    def reset_states(self):
        """Does nothing."""

    def act(self, observations):
        """Returns the action to stay for each agent."""
        return [0] * len(observations)


def metrics(rows):
    return [{name: value for name, value in row["metrics"].items() if name != "runtime"} for row in rows]
