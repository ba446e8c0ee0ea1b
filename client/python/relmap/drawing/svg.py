"""A small writer of SVG. Texts and attributes are escaped, so nothing that the map holds can become markup."""

from __future__ import annotations

import base64
from typing import Iterable, Mapping, Sequence, Tuple, Union
from xml.sax.saxutils import escape, quoteattr

Number = Union[int, float]
Point = Tuple[float, float]
Attributes = Mapping[str, Union[str, Number]]

# XML has no way to write most control characters.
_NOT_XML = {code: "\N{REPLACEMENT CHARACTER}" for code in range(32) if code not in (9, 10, 13)}
_NOT_XML.update({code: "\N{REPLACEMENT CHARACTER}" for code in (*range(0xD800, 0xE000), 0xFFFE, 0xFFFF)})


def safe_text(text: str) -> str:
    """The text, escaped for the content of an element of SVG or HTML."""
    return escape(str(text).translate(_NOT_XML))


def _number(value: Number) -> str:
    return str(value) if isinstance(value, int) else f"{value:.2f}".rstrip("0").rstrip(".")


def _attributes(values: Attributes) -> str:
    parts = []
    for name, value in values.items():
        text = value.translate(_NOT_XML) if isinstance(value, str) else _number(value)
        parts.append(f" {name.rstrip('_').replace('_', '-')}={quoteattr(text)}")
    return "".join(parts)


class Svg:
    """An SVG picture that is written element by element. Points are from the top left corner.

    Attributes of elements are keyword arguments: stroke_width=2 becomes stroke-width="2".
    """

    def __init__(self, width: Number, height: Number) -> None:
        self._width, self._height = width, height
        self._parts: list[str] = []

    def element(self, name: str, attributes: Attributes, content: str = "") -> None:
        """An element with this text as its content, which is escaped."""
        body = f">{safe_text(content)}</{name}>" if content else "/>"
        self._parts.append(f"<{name}{_attributes(attributes)}{body}")

    def line(self, a: Sequence[float], b: Sequence[float], **attributes: Union[str, Number]) -> None:
        """A straight line."""
        self.element("line", {"x1": a[0], "y1": a[1], "x2": b[0], "y2": b[1], **attributes})

    def polyline(self, points: Iterable[Sequence[float]], **attributes: Union[str, Number]) -> None:
        """Lines from point to point."""
        text = " ".join(f"{_number(float(p[0]))},{_number(float(p[1]))}" for p in points)
        self.element("polyline", {"points": text, "fill": "none", **attributes})

    def circle(self, at: Sequence[float], radius: Number, **attributes: Union[str, Number]) -> None:
        """A circle."""
        self.element("circle", {"cx": at[0], "cy": at[1], "r": radius, **attributes})

    def rect(self, at: Sequence[float], width: Number, height: Number, **attributes: Union[str, Number]) -> None:
        """A rectangle from its top left corner."""
        self.element("rect", {"x": at[0], "y": at[1], "width": width, "height": height, **attributes})

    def text(self, at: Sequence[float], content: str, **attributes: Union[str, Number]) -> None:
        """A text whose baseline begins at this point."""
        self.element("text", {"x": at[0], "y": at[1], **attributes}, content or " ")

    def image(self, at: Sequence[float], width: Number, height: Number, jpeg: bytes) -> None:
        """A JPEG, stretched to this size."""
        data = "data:image/jpeg;base64," + base64.b64encode(jpeg).decode()
        self.element("image", {"x": at[0], "y": at[1], "width": width, "height": height, "href": data})

    def finish(self, title: str) -> str:
        """The whole picture; `title` is for those who do not see it."""
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{_number(self._width)}" height="{_number(self._height)}"'
            f' viewBox="0 0 {_number(self._width)} {_number(self._height)}" role="img"'
            ' font-family="DejaVu Sans, Verdana, sans-serif" font-size="12">'
        )
        return "\n".join([head, f"<title>{safe_text(title)}</title>", *self._parts, "</svg>\n"])
