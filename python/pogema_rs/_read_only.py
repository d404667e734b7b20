"""Values that show the state of an environment, and cannot be modified."""

from __future__ import annotations

from typing import Any, ClassVar, NoReturn, TypeVar

from pogema_rs.errors import StateError

Item = TypeVar("Item")
Key = TypeVar("Key")


def _reject(self: Any, *_: Any, **__: Any) -> NoReturn:
    """Raises `StateError`."""
    text = "the state of an environment cannot be changed by hand"
    raise StateError(f"{text}; reset with agents_xy and targets_xy to place agents")


class ReadOnlyList(list[Item]):
    """A list whose mutating methods raise `StateError`; its copies are plain lists."""

    __slots__ = ()

    __setitem__ = __delitem__ = __iadd__ = __imul__ = _reject
    append = extend = insert = remove = pop = clear = sort = reverse = _reject

    def __reduce_ex__(self, protocol: Any) -> Any:
        return list, (list(self),)


class ReadOnlyDict(dict[Key, Item]):
    """A dictionary whose mutating methods raise `StateError`; its copies are plain dictionaries."""

    __slots__ = ()

    __setitem__ = __delitem__ = __ior__ = _reject
    update = setdefault = pop = popitem = clear = _reject

    def __reduce_ex__(self, protocol: Any) -> Any:
        return dict, (dict(self),)


class FixedAttributes:
    """An object with attributes that only the package sets, through `__dict__`."""

    # For each fixed attribute, what to do instead of setting it.
    _FIXED: ClassVar[dict[str, str]] = {}

    def __setattr__(self, name: str, value: Any) -> None:
        if name in self._FIXED:
            raise StateError(f"`{name}` of {type(self).__name__} cannot be set; {self._FIXED[name]}")
        super().__setattr__(name, value)
