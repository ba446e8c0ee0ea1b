"""Draws the two pictures of a loop closure side by side, with lines between what they both show."""

from __future__ import annotations

from typing import TYPE_CHECKING, Optional

import numpy as np

from relmap.drawing.picture import Drawing
from relmap.drawing.style import FAINT, INK, LOOP, NOT_IN_FORCE, PAPER
from relmap.drawing.svg import Svg
from relmap.graph import FramePicture

if TYPE_CHECKING:
    from relmap.evidence import Explanation

_GAP = 12.0
_MOST_LINES = 400


def _draw_picture(svg: Svg, picture: FramePicture, left: float, top: float, width: float, height: float) -> None:
    if picture.data:
        svg.image((left, top), width, height, picture.data)
    else:
        svg.rect((left, top), width, height, fill="#eeeeee")
        svg.text((left + 10, top + 24), picture.message or "no picture is kept", fill=FAINT)


def draw_pair(explanation: "Explanation", width: int = 900) -> Drawing:
    """The older picture on the left, the newer on the right. ValueError: the pictures were not asked for, or the width is not
    200..4000."""
    if not 200 <= width <= 4000:
        raise ValueError(f"width is {width}; must be 200..4000 points")
    a, b = explanation.picture_a, explanation.picture_b
    if a is None or b is None:
        raise ValueError("the pictures were not asked for: explain_edge(edge, pictures=True)")
    half = (width - _GAP) / 2
    shapes = [p.height / p.width if p.width else 0.75 for p in (a, b)]
    high = half * max(shapes)
    svg = Svg(width, high + 50)
    svg.rect((0, 0), width, high + 50, fill=PAPER)
    for picture, left, shape in ((a, 0.0, shapes[0]), (b, half + _GAP, shapes[1])):
        _draw_picture(svg, picture, left, 0, half, half * shape)

    def scale(picture: FramePicture) -> Optional[float]:
        return half / picture.width * picture.scale if picture.width and picture.scale else None

    both = explanation.correspondences
    sa, sb = scale(a), scale(b)
    if sa is not None and sb is not None:
        in_a = both.frame * sa
        in_b = both.view * sb + np.array([half + _GAP, 0])
        order = np.argsort(both.inlier, kind="stable")[-_MOST_LINES:]  # inliers last, so that they lie above
        for i in order.tolist():
            if both.seen_in[i] is not None:
                continue  # measured in another picture than the one that is shown
            inlier = bool(both.inlier[i])
            colour = LOOP if inlier else NOT_IN_FORCE
            pa, pb = (float(in_a[i, 0]), float(in_a[i, 1])), (float(in_b[i, 0]), float(in_b[i, 1]))
            svg.line(pa, pb, stroke=colour, stroke_width=0.8 if inlier else 0.5, stroke_opacity=0.8 if inlier else 0.5)
            for p in (pa, pb):
                svg.circle(p, 2, fill="none", stroke=colour, stroke_width=1)
    edge = explanation.edge
    svg.text((0, high + 18), f"{edge.a}", fill=INK)
    svg.text((half + _GAP, high + 18), f"{edge.b}", fill=INK)
    text = f"{edge.id}: {int(np.sum(both.inlier))} of {len(both)} points agree"
    if explanation.correspondences_message:
        text += f"; {explanation.correspondences_message}"
    svg.text((0, high + 38), text, fill=FAINT, font_size=11)
    return Drawing(svg.finish(f"the two pictures of the loop closure {text}"))
