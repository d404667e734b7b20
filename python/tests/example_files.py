"""The examples of the package, and those that need a framework."""

from pathlib import Path

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
# `./check frameworks` or `./check jax` installs the framework and runs the example.
WITH_FRAMEWORK = {"cleanrl_ppo.py", "jaxmarl_ippo.py", "train_mappo.py", "train_ppo.py", "train_ppo_jax.py"}
