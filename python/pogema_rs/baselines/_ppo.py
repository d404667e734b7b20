"""PPO on whole episodes: IPPO, MAPPO, Follower and EPOM."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch
from tensordict import TensorDict
from torch import nn
from torch.distributions import Categorical

from pogema_rs.baselines import _networks
from pogema_rs.baselines._acting import LEAST, Actor
from pogema_rs.baselines._config import PPOConfig, TrainingConfig
from pogema_rs.baselines._networks import AgentNetwork
from pogema_rs.baselines._record import Record
from pogema_rs.baselines._targets import advantages, last_steps


class PPOLearner:
    sampling = "softmax"
