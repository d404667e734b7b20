"""Learned policies that play in Rust."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NoReturn, Optional, Union, cast, overload

import numpy as np

from pogema_rs import _engine
from pogema_rs._checks import check_cells, check_semantics, check_whole
from pogema_rs._counted import counted
from pogema_rs._encoder import Encoder
from pogema_rs.semantics import Semantics

if TYPE_CHECKING:
    from pogema_rs.vec_env import VecEnv

#: The names of all learned policies.
LEARNED = tuple(_engine.WORDS["learned"])
_Path = Union[str, "os.PathLike[str]"]


class Policy:
    """A learned policy, which `load` reads. It plays in Rust, without PyTorch.

    It plays one `VecEnv` or one environment at a time. Every agent has its own recurrent state and its own stream of
    random numbers, and both start again with each episode of its environment. The actions of an episode therefore
    depend only on the episode and on the seed, as in `pogema evaluate`, and not on the number of threads or
    environments.

    A pickle holds the path of the weights and the settings, but no episode: the copy reads the file again.
    """

    def __init__(self, path: Optional[str], settings: dict[str, Any]) -> None:
        """Reads the weights; use `load`."""
        self._path, self._settings = path, settings
        search = (settings["expansions"], settings["faithful"])
        self._policy = _engine.Policy(
            settings["name"], path, settings["sampling"], settings["mask_actions"], settings["seed"],
            settings["num_threads"], search,
        )  # fmt: skip
        encoder, self.sampling = self._policy.encoder(), self._policy.sampling()
        #: The encoder of the network in the weights; None with `mats-lp`.
        self.encoder: Optional[Encoder] = None if encoder is None else Encoder.from_dict(json.loads(encoder))

    @property
    def name(self) -> str:
        """The name of the policy."""
        return str(self._settings["name"])

    @overload
    def act(self, observations: VecEnv[Any]) -> np.ndarray: ...

    @overload
    def act(
        self,
        observations: Sequence[Mapping[str, Any]],
        rewards: Any = None,
        dones: Any = None,
        info: Any = None,
        skip_agents: Optional[Sequence[Any]] = None,
    ) -> list[int]: ...

    def act(
        self,
        observations: Union[VecEnv[Any], Sequence[Mapping[str, Any]]],
        rewards: Any = None,
        dones: Any = None,
        info: Any = None,
        skip_agents: Optional[Sequence[Any]] = None,
    ) -> Union[np.ndarray, list[int]]:
        """Returns the actions of all agents in the current state.

        With a `VecEnv`, which may have any observations, returns an array for its `step`. Call it in every state from
        the reset on, because policies remember earlier states. A second call in a state returns the same actions.

        With the observations of one environment, of type `MAPF`, returns a list. Call `reset_states` before each
        episode. `info` holds the infos of the last reset or step, which say which agents are active. Without them, an
        agent counts as finished if it is on its goal and the centre of its `agents` window has no mark. With `soft`
        collisions, such an agent may instead be a vanished agent. `skip_agents` holds one flag per agent; an agent
        whose flag is set stays. `rewards` and `dones` are not used; pogema-toolbox passes them.

        After Ctrl-C, the next call in the same state returns the actions of the interrupted one; `mats-lp` then needs a
        new episode.

        Shape: `(num_envs, agents)`, int64

        Errors: TypeError for observations of another type; ValueError if they do not belong to one episode, if
        `info` or `skip_agents` has another length, if a logit is not finite, or with `mats-lp`, which needs a `VecEnv`.
        For a `VecEnv`, `StateError` if a logit is not finite, or if `mats-lp` misses a state. RuntimeError for a second
        environment without `reset_states`.
        """
        batch = getattr(observations, "_batch", None)
        if isinstance(batch, _engine.Batch):
            env = cast("VecEnv[Any]", observations)
            actions = np.empty((env.num_envs, env.num_agents), dtype=np.int64)
            self._policy.act_batch(batch, actions)
            return actions
        seen = _checked(observations)
        for name, given, what in (("info", info, "element"), ("skip_agents", skip_agents, "flag")):
            if given is not None and len(given) != len(seen):
                found = counted(len(given), what)
                raise ValueError(f"{name} holds {found}, expected {len(seen)}, one for each agent")
        actions_of_one = self._act_in_one(seen, info)
        if skip_agents is not None:
            return [0 if skips else action for action, skips in zip(actions_of_one, skip_agents)]
        return actions_of_one

    def _act_in_one(self, observations: Sequence[Mapping[str, Any]], info: Any) -> list[int]:
        first = observations[0]
        border = np.shape(first["obstacles"])[0] // 2
        cells, goals = (_cells_of(name, observations) for name in ("global_xy", "global_target_xy"))
        if info is not None and all(isinstance(one, Mapping) and "is_active" in one for one in info):
            active = [bool(one["is_active"]) for one in info]
        else:
            is_marked = [bool(np.asarray(seen["agents"])[border, border]) for seen in observations]
            active = [marked or cell != goal for marked, cell, goal in zip(is_marked, cells, goals)]
        obstacles = np.ascontiguousarray(np.asarray(first["global_obstacles"]) != 0, dtype=np.uint8)
        is_exact = self._settings["semantics"] == Semantics.DEVELOPED.value
        return self._policy.act(obstacles, border, cells, goals, active, is_exact)

    def logits(self, windows: np.ndarray, scalars: Optional[np.ndarray] = None) -> np.ndarray:
        """Returns the logits for a batch of windows, and of scalars if the encoder has any.

        Uses the recurrent state that an agent has at the beginning of an episode. The call does not affect the episodes
        that the policy plays.

        Shape: `windows` `(batch, channels, side, side)`, `scalars` `(batch, 2 * len(encoder.scalars))`; the result is
        `(batch, 5)`, or the two values `(batch, 2)` with `lswitcher`

        Errors: ValueError for arrays that do not fit the encoder, for a logit that is not finite, or with `mats-lp`.
        """
        if self.encoder is None:
            raise ValueError(f"{self.name!r} has no logits of single agents")
        windows = np.ascontiguousarray(windows, dtype=np.float32)
        batch, size = len(windows), 2 * len(self.encoder.scalars)
        if scalars is None:
            scalars = np.zeros((batch, 0))
        scalars = np.ascontiguousarray(scalars, dtype=np.float32)
        if windows.shape != (batch, *self.encoder.shape):
            raise ValueError(f"windows have shape {windows.shape}, expected {(batch, *self.encoder.shape)}")
        if scalars.shape != (batch, size):
            raise ValueError(f"scalars have shape {scalars.shape}, expected {(batch, size)}")
        return self._policy.logits(windows.reshape(batch, int(np.prod(self.encoder.shape))), scalars)

    def reset_states(self) -> None:
        """Forgets all episodes and the environment, so that the policy can play another one."""
        self._policy.reset()

    def __reduce__(self) -> tuple[Any, tuple[Optional[str], dict[str, Any]]]:
        return Policy, (self._path, self._settings)

    def __repr__(self) -> str:
        return f"Policy({self.name!r})" if self._path is None else f"Policy({self.name!r}, {self._path!r})"


def load(
    path: Optional[_Path] = None,
    *,
    name: str = "network",
    sampling: Optional[str] = None,
    mask_actions: Optional[bool] = None,
    seed: int = 0,
    num_threads: int = 1,
    expansions: Optional[int] = None,
    faithful: Optional[bool] = None,
    semantics: Union[str, Semantics] = Semantics.RELEASED,
) -> Policy:
    """Reads a learned policy from a file of weights, `.safetensors` or `.onnx`, and the JSON file beside it.

    `name` is the name of a policy in `LEARNED`. Without a path, the policy plays with the weights in this
    package; there are none for `mats-lp` and `network`. `sampling` is the rule that chooses an action: `softmax`,
    `greedy` or `follower` [default: that of the JSON file]. With `mask_actions`, no agent moves into an obstacle
    [default: as the JSON file says]. `seed` is the seed of the drawn actions. `num_threads`, `expansions` and
    `faithful` are settings of `mats-lp`. `semantics` are those of the environment whose `MAPF` observations the policy
    gets; a `VecEnv` has its own.

    Errors: FileNotFoundError or OSError for a file that cannot be read; TypeError or ValueError for a wrong file or
    setting. The message names the file or the setting.
    """
    if name not in LEARNED:
        raise ValueError(f"name is {name!r}, expected one of {', '.join(map(repr, LEARNED))}")
    settings = {
        "name": name,
        "sampling": sampling,
        "mask_actions": None if mask_actions is None else bool(mask_actions),
        "seed": check_whole("seed", seed, 0, 2**64 - 1),
        "num_threads": check_whole("num_threads", num_threads, 1, _engine.MAX_THREADS),
        "expansions": None if expansions is None else min(check_whole("expansions", expansions), 2**32 - 1),
        "faithful": faithful,
        "semantics": check_semantics(semantics).value,
    }
    return Policy(None if path is None else os.path.abspath(os.fspath(path)), settings)


def _checked(observations: Any) -> Sequence[Mapping[str, Any]]:
    names = ("global_obstacles", "global_xy", "global_target_xy", "obstacles", "agents")
    if not isinstance(observations, Sequence) or isinstance(observations, str):
        _reject()
    for seen in observations:
        if not isinstance(seen, Mapping) or not all(name in seen for name in names):
            _reject()
    if not observations or np.ndim(observations[0]["obstacles"]) != 2:
        _reject()
    return observations


def _reject() -> NoReturn:
    raise TypeError(
        "observations have the wrong type, expected a VecEnv, or the observations of one environment with "
        "observation_type='MAPF'"
    )


def _cells_of(name: str, observations: Sequence[Mapping[str, Any]]) -> list[tuple[int, int]]:
    cells = check_cells(name, [seen[name] for seen in observations], 2)
    return [(int(row), int(col)) for row, col in cells.tolist()]
