"""Colours, which everyone can tell apart on white (those of client/map_colours.h), and sizes of texts."""

from __future__ import annotations

SESSION_COLOURS = ("#0072b2", "#1fbb4b", "#bc96cf", "#4ca1ff", "#7e2e13", "#600371")
"""The colours of sessions, in the order in which they are drawn. They repeat after the last one."""
LOOP = "#d55e00"
"""Loop closures in force."""
NOT_IN_FORCE = "#92949a"
"""Other loop closures."""
ROUTE = "#f6be28"
"""Routes."""
QUERY = "#e40c6b"
"""What was asked for."""
INK = "#262a30"
"""Texts."""
FAINT = "#70767e"
"""Small texts."""
PAPER = "#ffffff"
"""What lies between marks."""


def session_colour(place: int) -> str:
    """The colour of the session that is drawn at this place."""
    return SESSION_COLOURS[place % len(SESSION_COLOURS)]


def text_width(text: str, size: float) -> float:
    """About the width of a text, points."""
    return 0.62 * size * len(text)


def shortened(text: str, size: float, width: float) -> str:
    """The text, cut so that it is about this wide at most."""
    most = max(int(width / (0.62 * size)), 1)
    return text if len(text) <= most else text[: most - 1] + "\N{HORIZONTAL ELLIPSIS}"
