"""The hyperparameters of a training run, read from YAML and checked."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any, Optional, TypeVar, Union, get_args, get_origin, get_type_hints

from pogema_rs import _engine
from pogema_rs._checks import LARGEST_RADIUS
from pogema_rs._encoder import Encoder
from pogema_rs._optional import import_optional
from pogema_rs.baselines._teacher import make_planner
from pogema_rs.semantics import Semantics

#: The methods that can be trained, by name.
METHODS = (
    "iql",
    "vdn",
    "qmix",
    "qplex",
    "ippo",
    "mappo",
    "follower",
    "follower-small",
    "follower-large",
    "epom",
    "lswitcher",
)

MAP_KINDS = ("random", "mazes", "warehouse", "plain")
#: The semantics of `VecEnv` by the rule of occupancy.
OCCUPANCIES = {"as_released": Semantics.RELEASED, "exact": Semantics.DEVELOPED}
GOAL_RULES = ("nothing", "restart", "finish")
#: Channels whose values are multiples of `1 / (2 * radius)`, so that a byte holds them exactly.
CHANNELS = (
    "obstacles", "agents", "all_agents", "goal", "cost_to_go", "path", "follower_path", "seen_agents", "seen_obstacles",
)  # fmt: skip

#: The largest radius of windows: a record holds their values times `2 * radius` in signed bytes.
LARGEST_ENCODER_RADIUS = 63
#: The largest integer and the largest float of a config. No training needs more, and 32 bits hold them.
LARGEST_WHOLE, LARGEST_NUMBER = 10**9, 1e6
SMALLEST_TEMPERATURE = 1e-6
LARGEST_CROWD = 10_000
#: The largest sizes by key. Larger networks take gigabytes, and a record holds each coordinate of an agent in a byte.
LARGEST_SIZES = {
    "environment.size": 255,
    "environment.obs_radius": LARGEST_RADIUS,
    "network.filters": 1024,
    "network.blocks": 64,
    "network.hidden": 4096,
    "network.recurrent": 4096,
    "learner.minibatches": 100_000,
    "learner.mixer_hidden": 4096,
    "learner.kernels": 4096,
    "learner.critic_hidden": 4096,
}

Section = TypeVar("Section")


@dataclass(frozen=True)
class EnvironmentConfig:
    """The episodes of a training run."""

    maps: tuple[str, ...] = ("random",)
    #: The numbers of agents, and the goal rules: each iteration plays one of each, in turn.
    num_agents: tuple[int, ...] = (8,)
    on_target: tuple[str, ...] = ("nothing",)
    max_episode_steps: int = 128
    collision_system: str = "soft"
    #: The agents that windows show: `as_released`, as in POGEMA 1.4.0, or `exact`, as in its 2.0 line.
    occupancy: str = "as_released"
    obs_radius: int = 5
    #: The side and the density of obstacles of `plain` maps.
    size: int = 8
    density: float = 0.3

    @property
    def kinds(self) -> list[tuple[str, int]]:
        """The kinds of episodes, in the order in which iterations play them.

        A kind is a pair of a goal rule and a number of agents.
        """
        return [(rule, crowd) for crowd in self.num_agents for rule in self.on_target]


@dataclass(frozen=True)
class RewardConfig:
    """The weights of the parts of the reward."""

    #: Whether each agent gets the mean of all agents' rewards.
    team: bool = False
    #: For reaching a goal; if `on_target` is `nothing`, for each step that ends on the goal.
    goal: float = 1.0
    #: For each step that leads nearer to the goal; negated for each step that leads away.
    progress: float = 0.0
    #: For each step that leads nearer to the goal than any step before.
    approach: float = 0.0
    #: For each cell of Follower's path that the agent enters.
    path: float = 0.0
    #: For each step.
    step: float = 0.0


@dataclass(frozen=True)
class NetworkConfig:
    """The sizes of the network that each agent plays with."""

    filters: int = 0
    blocks: int = 0
    #: The units of the dense layer; 0 for none.
    hidden: int = 128
    recurrent: int = 128


@dataclass(frozen=True)
class DescentConfig:
    """The hyperparameters that all learners have."""

    discount: float = 0.99
    learning_rate: float = 0.001
    #: The number of iterations in which the learning rate falls to half; 0 for a constant rate.
    half_life: int = 0
    max_gradient: float = 10.0


@dataclass(frozen=True)
class QLearningConfig(DescentConfig):
    """The hyperparameters of the methods that learn action values."""

    td_lambda: float = 0.6
    epsilon_start: float = 1.0
    epsilon_end: float = 0.05
    epsilon_steps: int = 100_000
    #: The trained network samples actions from the softmax of the values divided by this; 0 for the largest value.
    temperature: float = 0.0
    #: The trained network is a moving average, which keeps this share of itself in each iteration; 0 for the last
    #: network.
    averaging: float = 0.0
    replay: int = 5000
    batch: int = 32
    updates: int = 2
    target_episodes: int = 200
    mixer_hidden: int = 32
    kernels: int = 4
    own_loss: float = 0.0


@dataclass(frozen=True)
class PPOConfig(DescentConfig):
    """The hyperparameters of the methods that learn a policy by PPO."""

    learning_rate: float = 0.0005
    max_gradient: float = 0.5
    gae_lambda: float = 0.95
    clip: float = 0.2
    entropy: float = 0.01
    value: float = 0.5
    epochs: int = 3
    minibatches: int = 4
    #: As for `QLearningConfig`.
    averaging: float = 0.0
    masks: bool = True
    critic_hidden: int = 256


@dataclass(frozen=True)
class ValueConfig(DescentConfig):
    """The hyperparameters of the method that learns the values of given policies."""

    max_gradient: float = 4.0
    epochs: int = 1
    minibatches: int = 4


@dataclass(frozen=True)
class ImitationConfig:
    """The warm start of the methods that learn by PPO: first, the agents imitate a planner."""

    #: A lifelong planner if `on_target` is `restart`, else a one-shot planner.
    planner: str = "pibt"
    #: The planner's budget for each step.
    nodes: int = 1000
    #: If positive, the planner's goal of each agent is the cell this number of steps ahead on Follower's path.
    ahead: int = 0
    #: The number of iterations before PPO begins.
    iterations: int = 0


#: The hyperparameters of a learner.
LearnerConfig = Union[QLearningConfig, PPOConfig, ValueConfig]


def _learner_of(method: str) -> type[LearnerConfig]:
    """Returns the class of a method's learner hyperparameters."""
    if method == "lswitcher":
        return ValueConfig
    return QLearningConfig if method in ("iql", "vdn", "qmix", "qplex") else PPOConfig


@dataclass(frozen=True)
class ScheduleConfig:
    """What an iteration plays, and how often the training run is validated and saved."""

    lanes: int = 32
    validate_every: int = 50
    validation_episodes: int = 64
    validation_steps: int = 128
    checkpoint_every: int = 10


@dataclass(frozen=True)
class TrainingConfig:
    """All hyperparameters of one training run."""

    method: str
    encoder: Encoder
    learner: LearnerConfig
    environment: EnvironmentConfig = field(default_factory=EnvironmentConfig)
    rewards: RewardConfig = field(default_factory=RewardConfig)
    network: NetworkConfig = field(default_factory=NetworkConfig)
    imitation: ImitationConfig = field(default_factory=ImitationConfig)
    schedule: ScheduleConfig = field(default_factory=ScheduleConfig)

    def to_dict(self) -> dict[str, Any]:
        """Returns the values as a YAML file has them."""
        values: dict[str, Any] = _plain(dataclasses.asdict(self))
        return {**values, "encoder": _plain(self.encoder.to_dict())}


def load_config(
    method: str, path: Union[None, str, os.PathLike[str]] = None, changes: Sequence[str] = ()
) -> TrainingConfig:
    """Returns the hyperparameters of a method: those of the package, or those of a YAML file.

    `changes` are strings of the form `section.key=value`, which replace single values.

    Errors: ImportError without PyYAML; OSError for a file that cannot be read; ValueError or TypeError for a wrong
    value or an unknown key. The message names the file and the key, and for an unknown key the nearest known one.
    """
    if method not in METHODS:
        hint = _engine.did_you_mean(str(method), list(METHODS))
        raise ValueError(f"method is {method!r}, expected one of {', '.join(METHODS)}{hint}")
    yaml = import_optional("yaml", "reading the hyperparameters of a training run")
    if path is None:
        name = f"{method}.yaml"
        text = (resources.files(__package__) / "configs" / name).read_text(encoding="utf-8")
    else:
        name = os.fspath(path)
        try:
            text = Path(path).read_text(encoding="utf-8")
        except UnicodeDecodeError as error:
            raise ValueError(f"{name}: {error}") from None
    values = _parsed(yaml, text, name)
    if not isinstance(values, dict):
        raise TypeError(f"{name}: the file holds a value of type {type(values).__name__}, expected a mapping")
    for change in changes:
        _apply(values, change, yaml)
    if changes:
        name += f" with --set {changes[0]}" if len(changes) == 1 else f" with {len(changes)} changes by --set"
    return read_config(values, method, name)


def read_config(values: Mapping[str, Any], method: str, name: str) -> TrainingConfig:
    """Returns the checked hyperparameters of a mapping; error messages begin with `name`.

    Errors: ValueError or TypeError, see `load_config`.
    """
    sections: dict[str, Any] = {
        "environment": EnvironmentConfig,
        "rewards": RewardConfig,
        "network": NetworkConfig,
        "learner": _learner_of(method),
        "imitation": ImitationConfig,
        "schedule": ScheduleConfig,
    }
    _check_keys(name, "", values, ["method", "encoder", *sections])
    for key in ("method", "encoder"):
        if key not in values:
            raise ValueError(f"{name}: the key {key!r} is missing")
    if values["method"] != method:
        raise ValueError(f"{name}: method is {values['method']!r}, expected {method!r}")
    read = {key: _section(name, key, values.get(key, {}), kind) for key, kind in sections.items()}
    try:
        encoder = Encoder.from_dict(values["encoder"])
    except (TypeError, ValueError) as error:
        raise type(error)(f"{name}: encoder: {error}") from None
    config = TrainingConfig(method=method, encoder=encoder, **read)
    _check_values(name, config)
    return config


def _section(name: str, key: str, values: Any, kind: type[Section]) -> Section:
    if not isinstance(values, Mapping):
        raise TypeError(f"{name}: {key} is {values!r}, expected a mapping")
    hints = get_type_hints(kind)
    _check_keys(name, f"{key}.", values, list(hints))
    return kind(**{one: _value(f"{name}: {key}.{one}", values[one], hints[one]) for one in values})


def _value(place: str, value: Any, kind: Any) -> Any:
    if get_origin(kind) is tuple:
        word = get_args(kind)[0]
        if word is int and not isinstance(value, (list, tuple)):
            return (_value(place, value, int),)
        is_right = isinstance(value, (list, tuple)) and value and all(type(one) is word for one in value)
        if not is_right:
            raise TypeError(f"{place} is {value!r}, expected a list of {'whole numbers' if word is int else 'names'}")
        return tuple(_value(place, one, word) for one in value)
    if kind is float:
        # PyYAML reads `1e-4` as a string.
        with contextlib.suppress(ValueError, OverflowError):
            value = float(value) if isinstance(value, (int, str)) and not isinstance(value, bool) else value
        if isinstance(value, float) and not math.isfinite(value):
            raise ValueError(f"{place} is {value!r}, expected a finite number")
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        expected = {int: "a whole number", float: "a number", bool: "true or false", str: "a name"}[kind]
        raise TypeError(f"{place} is {value!r}, expected {expected}")
    if kind is int and value > LARGEST_WHOLE:
        raise ValueError(f"{place} is {value!r}, expected at most {LARGEST_WHOLE:,}")
    return value


def _check_keys(name: str, prefix: str, values: Mapping[str, Any], known: Sequence[str]) -> None:
    for key in values:
        if key not in known:
            hint = _engine.did_you_mean(prefix + str(key), [prefix + name for name in known])
            raise ValueError(f"{name}: unknown key `{prefix}{key}`{hint}")


def _check_values(name: str, config: TrainingConfig) -> None:
    """Checks the ranges of all values, and that they fit each other."""

    def check(is_right: bool, key: str, expected: str) -> None:
        if not is_right:
            section, _, last = key.partition(".")
            value = getattr(getattr(config, section), last)
            raise ValueError(f"{name}: {key} is {value!r}, expected {expected}")

    environment, learner, schedule = config.environment, config.learner, config.schedule
    check(all(kind in MAP_KINDS for kind in environment.maps), "environment.maps", f"names from {', '.join(MAP_KINDS)}")
    rules = f"names from {', '.join(GOAL_RULES)}"
    check(all(rule in GOAL_RULES for rule in environment.on_target), "environment.on_target", rules)
    crowds = environment.num_agents
    check(min(crowds) >= 1, "environment.num_agents", "numbers of at least 1")
    check(max(crowds) <= LARGEST_CROWD, "environment.num_agents", f"numbers of at most {LARGEST_CROWD}")
    for key in ("max_episode_steps", "obs_radius", "size"):
        check(getattr(environment, key) >= 1, f"environment.{key}", "at least 1")
    check(0 <= environment.density < 1, "environment.density", "at least 0, less than 1")
    systems = _engine.WORDS["collision_system"]
    check(environment.collision_system in systems, "environment.collision_system", f"one of {', '.join(systems)}")
    check(environment.occupancy in OCCUPANCIES, "environment.occupancy", f"one of {', '.join(OCCUPANCIES)}")
    known = all(channel in CHANNELS for channel in config.encoder.channels)
    check(known, "encoder.channels", f"names from {', '.join(CHANNELS)}")
    check(config.encoder.radius <= LARGEST_ENCODER_RADIUS, "encoder.radius", f"at most {LARGEST_ENCODER_RADIUS}")
    for key, largest in LARGEST_SIZES.items():
        section, _, last = key.partition(".")
        check(getattr(getattr(config, section), last, 0) <= largest, key, f"at most {largest}")
    for key in ("filters", "blocks", "hidden", "recurrent"):
        check(getattr(config.network, key) >= 0, f"network.{key}", "at least 0")
    needs_hidden = config.method == "mappo" or config.encoder.scalars
    expected = "at least 1 for mappo and for encoders with scalars"
    check(config.network.hidden > 0 or not needs_hidden, "network.hidden", expected)
    check(config.network.blocks == 0 or config.network.filters > 0, "network.blocks", "0 without filters")
    for one in dataclasses.fields(schedule):
        check(getattr(schedule, one.name) >= 1, f"schedule.{one.name}", "at least 1")
    # The lanes play the kinds of maps in turn, and begin with the first one in each iteration.
    for key in ("lanes", "validation_episodes"):
        num_maps = len(environment.maps)
        expected = f"at least {num_maps}, one for each of environment.maps"
        check(getattr(schedule, key) >= num_maps, f"schedule.{key}", expected)
    check(0 < learner.discount <= 1, "learner.discount", "more than 0, at most 1")
    check(0 < learner.learning_rate <= 1, "learner.learning_rate", "more than 0, at most 1")
    check(learner.half_life >= 0, "learner.half_life", "at least 0")
    check(learner.max_gradient > 0, "learner.max_gradient", "more than 0")
    _check_learner(check, learner, schedule)
    _check_imitation(check, name, config)
    for section in ("environment", "rewards", "learner"):
        for key, value in vars(getattr(config, section)).items():
            is_small = not isinstance(value, float) or abs(value) <= LARGEST_NUMBER
            check(is_small, f"{section}.{key}", f"-{LARGEST_NUMBER:,.0f} to {LARGEST_NUMBER:,.0f}")


def _check_imitation(check: Any, name: str, config: TrainingConfig) -> None:
    imitation = config.imitation
    check(imitation.nodes >= 1, "imitation.nodes", "at least 1")
    for key in ("iterations", "ahead"):
        check(getattr(imitation, key) >= 0, f"imitation.{key}", "at least 0")
    sees_paths = "follower_path" in config.encoder.channels
    check(imitation.ahead == 0 or sees_paths, "imitation.ahead", "0 without the channel 'follower_path'")
    # The cells ahead of two agents may be the same, and one-shot planners reject equal goals.
    is_lifelong = set(config.environment.on_target) == {"restart"}
    check(imitation.ahead == 0 or is_lifelong, "imitation.ahead", "0 unless environment.on_target is 'restart'")
    if imitation.iterations:
        learns_a_policy = isinstance(config.learner, PPOConfig)
        check(learns_a_policy, "imitation.iterations", f"0, because {config.method} learns no policy by PPO")
        for rule in config.environment.on_target:
            # A planner avoids agents that have finished and left.
            check(
                rule != "finish",
                "environment.on_target",
                "'nothing' or 'restart', because planners cannot advise agents with 'finish'",
            )
    for rule in config.environment.on_target:
        try:
            make_planner(imitation.planner, imitation.nodes, rule, config.environment.max_episode_steps)
        except ValueError as error:
            raise ValueError(f"{name}: imitation: {error}") from None


def _check_learner(check: Any, learner: LearnerConfig, schedule: ScheduleConfig) -> None:
    if isinstance(learner, (QLearningConfig, PPOConfig)):
        check(0 <= learner.averaging < 1, "learner.averaging", "at least 0, less than 1")
    if isinstance(learner, QLearningConfig):
        check(0 <= learner.td_lambda <= 1, "learner.td_lambda", "0 to 1")
        check(learner.own_loss >= 0, "learner.own_loss", "at least 0")
        # The softmax of larger quotients overflows.
        can_divide = learner.temperature == 0 or learner.temperature >= SMALLEST_TEMPERATURE
        check(can_divide, "learner.temperature", f"0, or at least {SMALLEST_TEMPERATURE}")
        check(0 <= learner.epsilon_end <= 1, "learner.epsilon_end", "0 to 1")
        check(0 <= learner.epsilon_start <= 1, "learner.epsilon_start", "0 to 1")
        check(learner.replay >= schedule.lanes, "learner.replay", f"at least {schedule.lanes}, the number of lanes")
        for key in ("epsilon_steps", "batch", "updates", "target_episodes", "mixer_hidden", "kernels"):
            check(getattr(learner, key) >= 1, f"learner.{key}", "at least 1")
        return
    if isinstance(learner, PPOConfig):
        check(0 <= learner.gae_lambda <= 1, "learner.gae_lambda", "0 to 1")
        check(learner.clip > 0, "learner.clip", "more than 0")
        for key in ("entropy", "value"):
            check(getattr(learner, key) >= 0, f"learner.{key}", "at least 0")
        check(learner.critic_hidden >= 1, "learner.critic_hidden", "at least 1")
    for key in ("epochs", "minibatches"):
        check(getattr(learner, key) >= 1, f"learner.{key}", "at least 1")


def _apply(values: dict[str, Any], change: str, yaml: Any) -> None:
    key, is_change, text = change.partition("=")
    section, has_section, last = key.partition(".")
    if not is_change or not has_section:
        raise ValueError(f"--set {change!r}: expected SECTION.KEY=VALUE, for example learner.discount=0.95")
    inner = values.setdefault(section, {})
    if not isinstance(inner, dict):
        raise ValueError(f"--set {change!r}: {section!r} is not a section, expected SECTION.KEY=VALUE")
    inner[last] = _parsed(yaml, text, f"--set {change!r}")


def _parsed(yaml: Any, text: str, name: str) -> Any:
    """Returns the value of a YAML text; error messages begin with `name`.

    Errors: ValueError.
    """

    class Loader(yaml.SafeLoader):
        def construct_mapping(self, node: Any, deep: bool = False) -> Any:
            """Rejects a repeated key. PyYAML would keep the key's last value."""
            words = [key.value for key, _ in node.value] if isinstance(node, yaml.MappingNode) else []
            repeated = [word for index, word in enumerate(words) if word in words[:index]]
            if repeated:
                raise yaml.MarkedYAMLError(problem=f"the key {repeated[0]!r} is repeated", problem_mark=node.start_mark)
            return super().construct_mapping(node, deep)

    try:
        return yaml.load(text, Loader)
    # PyYAML does not catch errors of dates, numbers and nested lists.
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ValueError(f"{name}: {' '.join(str(error).split())}") from None


def _plain(value: Any) -> Any:
    """Returns a value with lists in place of tuples, as YAML and JSON store them."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, (list, tuple)) else value


def completed(saved: Mapping[str, Any], config: TrainingConfig) -> dict[str, Any]:
    """Returns the config of a checkpoint with the defaults of fields that did not exist when it was written."""
    full = dict(saved)
    for one in dataclasses.fields(config):
        section = getattr(config, one.name)
        if dataclasses.is_dataclass(section) and isinstance(saved.get(one.name), Mapping):
            known = {each.name: each.default for each in dataclasses.fields(section)}
            defaults = {name: value for name, value in known.items() if value is not dataclasses.MISSING}
            full[one.name] = {**_plain(defaults), **saved[one.name]}
    return full


def first_difference(ours: Mapping[str, Any], theirs: Mapping[str, Any], prefix: str = "") -> Optional[str]:
    """Returns the first key whose values differ, with both values; None if all are equal."""
    for key in sorted({*ours, *theirs}):
        one, other = ours.get(key), theirs.get(key)
        if isinstance(one, Mapping) and isinstance(other, Mapping):
            inner = first_difference(one, other, f"{prefix}{key}.")
            if inner is not None:
                return inner
        elif one != other:
            return f"{prefix}{key} is {one!r}, not {other!r}"
    return None
