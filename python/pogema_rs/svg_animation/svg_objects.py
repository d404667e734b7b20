"""Elements of an SVG drawing whose y axis points up, as in POGEMA.

Environments do not use these classes: their engine draws the episodes.

Source: POGEMA 1.4.0, `svg_animation/svg_objects.py`
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Optional
from xml.sax.saxutils import quoteattr

__all__ = ["Animation", "Circle", "Line", "Rectangle", "RectangleHref", "SvgObject"]


class SvgObject:
    """An element with attributes and animations; `_` in the name of an attribute stands for `-`."""

    tag: Optional[str] = None

    def __init__(self, **kwargs: Any) -> None:
        self.attributes: dict[str, Any] = kwargs
        self.animations: list[SvgObject] = []

    def add_animation(self, animation: SvgObject) -> None:
        """Adds an animation of one of the attributes."""
        self.animations.append(animation)

    @staticmethod
    def render_attributes(attributes: Mapping[str, Any]) -> str:
        """Returns the text of attributes, sorted by name."""
        return " ".join(f"{name.replace('_', '-')}={quoteattr(str(attributes[name]))}" for name in sorted(attributes))

    def render(self) -> str:
        """Returns the text of the element with its animations."""
        start = f"<{self.tag} {self.render_attributes(self.attributes)}"
        if not self.animations:
            return f"{start}/>"
        return "\n".join([f"{start}>", *(animation.render() for animation in self.animations), f"</{self.tag}>"])

    def __str__(self) -> str:
        return self.render()

    def _flip(self, *names: str) -> None:
        """Mirrors coordinates, because the y axis of SVG points down."""
        for name in names:
            self.attributes[name] = -self.attributes[name]


class Rectangle(SvgObject):
    """A rectangle above and to the right of (`x`, `y`)."""

    tag = "rect"

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.attributes["y"] += self.attributes["height"]
        self._flip("y")


class RectangleHref(Rectangle):
    """A copy of the obstacle that a `Drawing` defines, above and to the right of (`x`, `y`)."""

    tag = "use"

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        del self.attributes["height"]
        self.attributes["href"] = "#obstacle"


class Circle(SvgObject):
    """A circle around (`cx`, `cy`)."""

    tag = "circle"

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self._flip("cy")


class Line(SvgObject):
    """A line from (`x1`, `y1`) to (`x2`, `y2`)."""

    tag = "line"

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self._flip("y1", "y2")


class Animation(SvgObject):
    """The animation of an attribute of the element that contains it."""

    tag = "animate"
