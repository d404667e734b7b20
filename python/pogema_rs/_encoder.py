"""Encoders: the settings of what a policy observes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, Union

from pogema_rs import _engine
from pogema_rs._checks import LARGEST_RADIUS, check_whole

_MAX_ENTRIES = 64


@dataclass(frozen=True)
class Encoder:
    """The settings of an encoder: the windows and scalars that a policy observes for each agent.

    The fields are those of `encoder` in the JSON file of a network. Each list has at most 64 entries and may
    name an entry more than once.

    Shape: windows `(channels, side, side)` with `side = 2 * radius + 1`, scalars `(2 * len(scalars),)`, both float32
    """

    #: Number of cells that a window shows in each direction, 1 to 128.
    radius: int
    #: The windows of each agent, in this order.
    channels: tuple[str, ...]
    #: The scalars of each agent, in this order. Each kind has two values.
    scalars: tuple[str, ...] = ()
    #: Number of cells that an agent sees in each direction, for `seen_agents`, `seen_obstacles` and
    #: `follower_path`, 1 to 128.
    sight: int = 5
    #: The version of Follower whose path `follower_path` shows: `cpp` or `python`.
    follower: str = "cpp"

    def __init__(
        self,
        radius: int,
        channels: Sequence[str],
        scalars: Sequence[str] = (),
        sight: int = 5,
        follower: str = "cpp",
    ) -> None:
        """Checks all values.

        Errors: TypeError or ValueError for the first wrong value.
        """
        values = {
            "radius": check_whole("radius", radius, 1, LARGEST_RADIUS),
            "channels": _words("channels", channels, "channel"),
            "scalars": _words("scalars", scalars, "scalars"),
            "sight": check_whole("sight", sight, 1, LARGEST_RADIUS),
            "follower": _word("follower", follower, "follower"),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Encoder:
        """Makes an encoder from the fields in the JSON file of a network.

        Errors: TypeError or ValueError for a missing, an unknown or a wrong field.
        """
        if not isinstance(values, Mapping):
            raise TypeError(f"encoder has type {type(values).__name__}, expected an Encoder or a dict")
        known = [field.name for field in fields(cls)]
        for name in values:
            if name not in known:
                raise ValueError(f"encoder has the unknown field {name!r}, expected {_listed(known)}")
        for name in ("radius", "channels"):
            if name not in values:
                raise ValueError(f"encoder has no field {name!r}")
        return cls(**values)

    def to_dict(self) -> dict[str, Any]:
        """Returns the fields as the JSON file of a network has them."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}

    @property
    def shape(self) -> tuple[int, int, int]:
        """The shape of the windows of one agent: channels, rows, columns."""
        side = 2 * self.radius + 1
        return len(self.channels), side, side


def read_encoder(encoder: Union[Encoder, Mapping[str, Any]]) -> Encoder:
    """Returns an encoder that is given as an `Encoder` or as a dict.

    Errors: those of `Encoder.from_dict`.
    """
    return encoder if isinstance(encoder, Encoder) else Encoder.from_dict(encoder)


def _words(name: str, values: Any, kind: str) -> tuple[str, ...]:
    if isinstance(values, str) or not isinstance(values, Sequence):
        raise TypeError(f"{name} is {values!r}, expected a list of names")
    if len(values) > _MAX_ENTRIES:
        raise ValueError(f"{name} is a list of {len(values)}, expected at most {_MAX_ENTRIES}")
    return tuple(_word(f"{name}[{place}]", value, kind) for place, value in enumerate(values))


def _word(name: str, value: Any, kind: str) -> str:
    known = _engine.WORDS[kind]
    if value not in known:
        raise ValueError(f"{name} is {value!r}, expected {_listed(known)}")
    return str(value)


def _listed(names: Sequence[str]) -> str:
    return "one of " + ", ".join(map(repr, names))
