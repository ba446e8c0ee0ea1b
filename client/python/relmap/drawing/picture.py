"""Draws maps, routes and surroundings from above."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from relmap.drawing.plan import Plan, draw_scale, thinned
from relmap.drawing.style import (
    FAINT,
    INK,
    LOOP,
    NOT_IN_FORCE,
    PAPER,
    QUERY,
    ROUTE,
    session_colour,
    shortened,
    text_width,
)
from relmap.drawing.svg import Point, Svg
from relmap.geometry import Array
from relmap.graph import EdgeKind, EdgeState, LabelledFrames

if TYPE_CHECKING:
    from relmap.relaxation import RelaxedPicture
    from relmap.routes import Neighbourhood, Route

_MARGIN = 24.0
_MOST_PARTS = 13
_MOST_LABELS = 60
_MOST_SESSIONS = 12  # in the legend
_RING = 7.0  # radius of the mark at an end of a route, points, with its rim
_RELAXED = "A relaxed picture: cycles are bent until they close. Not for measuring."


@dataclass(frozen=True)
class Drawing:
    """A picture. Notebooks show it.

    Attributes:
        svg: the text of an SVG file.
    """

    svg: str

    def save(self, path: "Union[str, os.PathLike[str]]") -> None:
        """Writes the SVG file. OSError: it cannot be written. ValueError: the name is that of another format."""
        if Path(path).suffix.lower() != ".svg":
            raise ValueError(f"a drawing is an SVG, and {os.fspath(path)!r} does not end with .svg")
        Path(path).write_text(self.svg, encoding="utf-8")

    def _repr_svg_(self) -> str:
        return self.svg

    def __repr__(self) -> str:
        return f"<Drawing of {len(self.svg)} bytes; save() writes it, a notebook shows it>"


def _check_width(width: int) -> None:
    if not 200 <= width <= 4000:
        raise ValueError(f"width is {width}; must be 200..4000 points")


class _Labels:
    """Places texts beside their points so that they cover neither one another nor marks."""

    def __init__(self, width: float) -> None:
        self._width = width
        self._boxes: List[Tuple[float, float, float, float]] = []
        self._marks: List[Tuple[Point, float]] = []

    def avoid(self, at: Sequence[float], radius: float) -> None:
        """Keeps texts off a round mark, also the text of the point that lies in it."""
        x, y = float(at[0]), float(at[1])
        self._marks.append(((x, y), radius))
        self._boxes.append((x - radius, y - radius, x + radius, y + radius))

    def draw(self, svg: Svg, at: Point, text: str) -> None:
        wide, high = text_width(text, 11), 13.0
        svg.circle(at, 3.5, fill=INK, stroke=PAPER, stroke_width=1)
        # Beyond the marks that the point lies in.
        away = [(float(np.hypot(at[0] - mark[0], at[1] - mark[1])), radius) for mark, radius in self._marks]
        clear = max((distance + radius for distance, radius in away if distance < radius), default=3.0)
        tries = (
            (at[0] + clear + 4, at[1] + 4),
            (at[0] - clear - 4 - wide, at[1] + 4),
            (at[0] - wide / 2, at[1] - clear - 5),
            (at[0] - wide / 2, at[1] + clear + 13),
        )
        for x, y in tries:
            x = min(max(x, 2.0), max(self._width - wide - 2, 2.0))
            box = (x, y - high, x + wide, y + 3)
            if not any(b[0] < box[2] and box[0] < b[2] and b[1] < box[3] and box[1] < b[3] for b in self._boxes):
                self._boxes.append(box)
                svg.text((x, y), text, fill=INK, font_size=11, stroke=PAPER, stroke_width=3, paint_order="stroke")
                return


def _arrow(svg: Svg, at: Array, along: Array, colour: str) -> None:
    length = float(np.hypot(*along))
    if length < 1e-9:
        return
    d = along / length
    n = np.array([-d[1], d[0]])
    points = [at + 6 * d, at - 4 * d + 4 * n, at - 4 * d - 4 * n]
    text = " ".join(f"{p[0]:.1f},{p[1]:.1f}" for p in points)
    svg.element("polygon", {"points": text, "fill": colour, "stroke": PAPER, "stroke_width": 1})


class _MapDrawing:
    def __init__(
        self, picture: "RelaxedPicture", width: int, names: Mapping[int, str], labelled: Sequence[LabelledFrames]
    ) -> None:
        self.picture, self.width = picture, width
        self.chains = picture.skeleton.chains
        self.names = names
        self.sessions = sorted({chain.session for chain in self.chains})
        self.colour = {session: session_colour(k) for k, session in enumerate(self.sessions)}
        self.places: Dict[Tuple[int, int], Tuple[int, int]] = {}  # session and index: chain and point
        for c, chain in enumerate(self.chains):
            for i, index in enumerate(chain.index.tolist()):
                self.places.setdefault((chain.session, index), (c, i))
        self.labelled = labelled
        self.parts = max(picture.parts, default=-1) + 1

    def draw(self) -> Drawing:
        if not self.chains:
            svg = Svg(self.width, 60)
            svg.text((_MARGIN, 34), "The map has no frames that could be drawn.", fill=FAINT)
            return Drawing(svg.finish("an empty map"))
        shown = min(self.parts, _MOST_PARTS)
        panels, y = self._panels(shown)
        legend = self._legend_rows()
        height = y + 20 + 20 * len(legend) + 40
        svg = Svg(self.width, height)
        svg.rect((0, 0), self.width, height, fill=PAPER)
        for part, plan, bottom in panels:
            self._draw_part(svg, part, plan)
            draw_scale(svg, (plan.left, bottom), plan.plan.scale)
        self._draw_legend(svg, legend, y + 20)
        more = f" {self.parts - shown} smaller parts are not shown." if self.parts > shown else ""
        svg.text((_MARGIN, height - 14), _RELAXED + more, fill=FAINT, font_size=11)
        frames = self.picture.skeleton.frames_total
        return Drawing(svg.finish(f"a map of {frames} frames in {len(self.sessions)} sessions, seen from above"))

    @dataclass
    class _Panel:
        plan: Plan
        left: float

    def _panels(self, shown: int) -> "tuple[list[tuple[int, _MapDrawing._Panel, float]], float]":
        panels = []
        y = _MARGIN
        row: List[int] = []
        rows = [[0]] + [list(range(k, min(k + 4, shown))) for k in range(1, shown, 4)]
        for row in rows:
            wide = (self.width - _MARGIN * (len(row) + 1)) / len(row) if row != [0] else self.width - 2 * _MARGIN
            if row != [0]:
                wide = (self.width - _MARGIN * 5) / 4
            lowest = y
            for k, part in enumerate(row):
                left = _MARGIN + k * (wide + _MARGIN)
                plan = Plan(self._positions(part), left, y, wide, 0.7 * self.width if part == 0 else wide)
                panels.append((part, self._Panel(plan, left), y + plan.height + 22))
                lowest = max(lowest, y + plan.height + 22)
            y = lowest + 14
        return panels, y

    def _positions(self, part: int) -> Array:
        poses = [T for T, p in zip(self.picture.chains, self.picture.parts) if p == part]
        return np.concatenate([T[:, :3, 3] for T in poses])

    def _draw_part(self, svg: Svg, part: int, panel: "_MapDrawing._Panel") -> None:
        on_page = {
            c: panel.plan.at(T[:, :3, 3])
            for c, (T, p) in enumerate(zip(self.picture.chains, self.picture.parts))
            if p == part
        }
        for c, points in on_page.items():
            self._draw_chain(svg, c, points)
        self._draw_closures(svg, on_page)
        labels = _Labels(self.width)
        for at, text in self._labels(on_page)[:_MOST_LABELS]:
            labels.draw(svg, at, text)

    def _draw_chain(self, svg: Svg, c: int, points: Array) -> None:
        chain, colour = self.chains[c], self.colour[self.chains[c].session]
        begin = 0
        kinds = np.where(chain.carried, 2, np.where(chain.unmeasured, 1, 0))
        for i in range(1, len(kinds) + 1):
            if i == len(kinds) or kinds[i] != kinds[begin]:
                if len(kinds):
                    dash = ("none", "2 3", "8 4")[int(kinds[begin])]
                    svg.polyline(
                        thinned(points[begin : i + 1]), stroke=colour, stroke_width=2, stroke_dasharray=dash,
                        stroke_linejoin="round",
                    )  # fmt: skip
                begin = i
        svg.circle((points[0][0], points[0][1]), 4, fill=PAPER, stroke=colour, stroke_width=2)
        if len(points) > 1:
            _arrow(svg, points[-1], points[-1] - points[max(len(points) - 3, 0)], colour)

    def _draw_closures(self, svg: Svg, on_page: Dict[int, Array]) -> None:
        closures = self.picture.skeleton.closures
        for k in range(len(closures)):
            a = self.places.get((int(closures.a[k, 0]), int(closures.a[k, 1])))
            b = self.places.get((int(closures.b[k, 0]), int(closures.b[k, 1])))
            if a is None or b is None or a[0] not in on_page or b[0] not in on_page:
                continue
            pa, pb = on_page[a[0]][a[1]], on_page[b[0]][b[1]]
            in_force = closures.state[k] == EdgeState.ACCEPTED
            colour, dash = (LOOP, "none") if in_force else (NOT_IN_FORCE, "4 3")
            svg.line((pa[0], pa[1]), (pb[0], pb[1]), stroke=colour, stroke_width=1.2, stroke_dasharray=dash)
            for p in (pa, pb):
                svg.circle((p[0], p[1]), 1.8, fill=colour)

    def _labels(self, on_page: Dict[int, Array]) -> List[Tuple[Point, str]]:
        found: List[Tuple[Point, str]] = []
        for label in self.labelled:
            for frame in label.frames[:3]:
                place = self._nearest(frame.session, frame.index, on_page)
                if place is not None:
                    found.append(((float(place[0]), float(place[1])), shortened(label.label, 11, 160)))
                    break
        return found

    def _nearest(self, session: int, index: int, on_page: Dict[int, Array]) -> Optional[Array]:
        for c, points in on_page.items():
            chain = self.chains[c]
            if chain.session == session and chain.index[0] <= index <= chain.index[-1]:
                at = np.interp(index, chain.index, np.arange(len(chain)))
                i = int(at)
                j = min(i + 1, len(points) - 1)
                return np.asarray(points[i] + (at - i) * (points[j] - points[i]))
        return None

    def _legend_rows(self) -> List[List[Tuple[str, str, str]]]:
        """Rows of entries: a kind of mark, its colour, and a text."""
        entries = [
            ("motion", self.colour[s], self.names.get(s, f"session {s}")) for s in self.sessions[:_MOST_SESSIONS]
        ]
        if len(self.sessions) > _MOST_SESSIONS:
            entries.append(("none", INK, f"and {len(self.sessions) - _MOST_SESSIONS} more sessions"))
        closures = self.picture.skeleton.closures  # each stands for all that are alike
        accepted = closures.state == EdgeState.ACCEPTED
        in_force, others = int(closures.alike[accepted].sum()), int(closures.alike[~accepted].sum())
        if in_force:
            entries.append(("loop", LOOP, f"{in_force} loop closures in force"))
        if others:
            entries.append(("dashed", NOT_IN_FORCE, f"{others} others"))
        if any(chain.unmeasured.any() for chain in self.chains):
            entries.append(("dotted", INK, "a guess of the motion"))
        if any(chain.carried.any() for chain in self.chains):
            entries.append(("carried", INK, "the robot was carried"))
        rows: List[List[Tuple[str, str, str]]] = [[]]
        x = _MARGIN
        for kind, colour, text in entries:
            text = shortened(text, 12, 260)
            wide = 40 + text_width(text, 12) + 16
            if x + wide > self.width - _MARGIN and rows[-1]:
                rows.append([])
                x = _MARGIN
            rows[-1].append((kind, colour, text))
            x += wide
        return rows

    def _draw_legend(self, svg: Svg, rows: List[List[Tuple[str, str, str]]], top: float) -> None:
        dashes = {"dashed": "4 3", "dotted": "2 3", "carried": "8 4"}
        for row in rows:
            x = _MARGIN
            for kind, colour, text in row:
                if kind != "none":
                    wide = 1.2 if kind in ("loop", "dashed") else 2
                    dash = dashes.get(kind, "none")
                    svg.line((x, top - 4), (x + 28, top - 4), stroke=colour, stroke_width=wide, stroke_dasharray=dash)
                svg.text((x + 36, top), text, fill=INK)
                x += 40 + text_width(text, 12) + 16
            top += 20


def draw_map(
    picture: "RelaxedPicture",
    width: int = 900,
    names: Mapping[int, str] = {},
    labels: Sequence[LabelledFrames] = (),
) -> Drawing:
    """A map seen from above: sessions, closures and labels; its parts in panels of their own, each at its own scale.

    ValueError: width is not 200..4000.

    Args:
        picture: positions.
        width: of the page, points.
        names: of sessions, for the legend.
        labels: drawn beside their frames.
    """
    _check_width(width)
    return _MapDrawing(picture, width, names, labels).draw()


def draw_route(route: "Route", width: int = 800) -> Drawing:
    """A route seen from above, with its labels. ValueError: width is not 200..4000."""
    _check_width(width)
    if not len(route):
        svg = Svg(width, 60)
        svg.text((_MARGIN, 34), "The route has no frames.", fill=FAINT)
        return Drawing(svg.finish("an empty route"))
    plan = Plan(route.T[:, :3, 3], _MARGIN, _MARGIN, width - 2 * _MARGIN, 0.6 * width)
    height = plan.height + 2 * _MARGIN + 56
    svg = Svg(width, height)
    svg.rect((0, 0), width, height, fill=PAPER)
    points = plan.at(route.T[:, :3, 3])
    svg.polyline(thinned(points), stroke=ROUTE, stroke_width=8, stroke_linejoin="round", stroke_linecap="round")
    for i in range(len(points) - 1):
        if route.kinds[i] == EdgeKind.LOOP:
            svg.line(points[i], points[i + 1], stroke=LOOP, stroke_width=2)
    svg.polyline(thinned(points), stroke=INK, stroke_width=1)
    svg.circle(points[0], 6, fill=PAPER, stroke=INK, stroke_width=2)
    svg.circle(points[-1], 6, fill=QUERY, stroke=PAPER, stroke_width=2)
    labels = _Labels(width)
    for end in (points[0], points[-1]):
        labels.avoid(end, _RING)
    shown = [(i, label) for i, all_of in enumerate(route.labels) for label in all_of]
    for i, label in shown[:_MOST_LABELS]:
        labels.draw(svg, (float(points[i][0]), float(points[i][1])), shortened(label, 11, 160))
    draw_scale(svg, (_MARGIN, height - 40), plan.scale)
    loops = sum(kind == EdgeKind.LOOP for kind in route.kinds)
    text = f"{route.frames[0]} to {route.frames[-1]}: {route.length_m:.1f} m, {route.duration_s:.0f} s, {len(route)} frames, {loops} loop closures"
    svg.text((_MARGIN, height - 14), text, fill=INK)
    return Drawing(svg.finish(f"a route, {text}"))


def draw_neighbourhood(around: "Neighbourhood", width: int = 800) -> Drawing:
    """The surroundings of a frame seen from above. ValueError: width is not 200..4000."""
    _check_width(width)
    positions = around.T[:, :3, 3]
    plan = Plan(positions, _MARGIN, _MARGIN, width - 2 * _MARGIN, 0.6 * width)
    height = plan.height + 2 * _MARGIN + 56
    svg = Svg(width, height)
    svg.rect((0, 0), width, height, fill=PAPER)
    points = plan.at(positions)
    place = {frame: i for i, frame in enumerate(around.frames)}
    colours = {s: session_colour(k) for k, s in enumerate(sorted({f.session for f in around.frames}))}
    for marks in around.landmarks:
        for at in plan.at(marks.reshape(-1, 3)):
            svg.circle(at, 0.8, fill=FAINT)
    for edge in around.edges:
        if edge.a in place and edge.b in place:
            a, b = points[place[edge.a]], points[place[edge.b]]
            colour = LOOP if edge.kind == EdgeKind.LOOP else colours[edge.b.session]
            svg.line(a, b, stroke=colour, stroke_width=1.2 if edge.kind == EdgeKind.LOOP else 2)
    _arrow(svg, points[0], plan.direction(around.T[0]), QUERY)
    labels = _Labels(width)
    labels.avoid(points[0], _RING)
    shown = [(i, label) for i, all_of in enumerate(around.labels) for label in all_of]
    for i, label in shown[:_MOST_LABELS]:
        labels.draw(svg, (float(points[i][0]), float(points[i][1])), shortened(label, 11, 160))
    draw_scale(svg, (_MARGIN, height - 40), plan.scale)
    text = f"{len(around)} frames around {around.frames[0]}" + (", more were cut off" if around.cut else "")
    svg.text((_MARGIN, height - 14), text, fill=INK)
    return Drawing(svg.finish(text))
