"""Tables and texts as HTML that notebooks show. Everything is escaped."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Mapping, Sequence

from relmap.drawing.svg import safe_text
from relmap.graph import Verification

if TYPE_CHECKING:
    from relmap.evidence import EdgeEdit, Explanation
    from relmap.graph import Edge


def _cell(value: Any) -> str:
    return safe_text(f"{value:.3g}" if isinstance(value, float) else str(value))


def table_html(columns: Sequence[str], rows: Sequence[Mapping[str, Any]], total: int, what: str) -> str:
    """A table of these rows, which are the first of `total`."""
    head = "".join(f"<th>{safe_text(column)}</th>" for column in columns)
    body = "".join("<tr>" + "".join(f"<td>{_cell(row[c])}</td>" for c in columns) + "</tr>" for row in rows)
    more = f"<p>{total} {safe_text(what)}, the first {len(rows)} of them are shown</p>" if total > len(rows) else ""
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}"


def _verification_text(edge: "Edge") -> str:
    """How geometry confirmed a closure, or why nothing says so."""
    if edge.verification == Verification.IMPORTED:
        return f"imported with session {edge.id.frame.session}, not verified here"
    if edge.verification == Verification.COMPOUNDED:
        return "made of the edges through a session that was deleted, not verified itself"
    if edge.verification == Verification.NONE:
        return "not verified"
    return f"verified by {edge.verification.name.lower()}: {edge.inliers} inliers"


def explanation_html(explanation: "Explanation") -> str:
    """What a loop closure is believed for, with its pictures if they were asked for."""
    edge = explanation.edge
    lines = [
        f"<b>{safe_text(str(edge.id))}</b>: {safe_text(str(edge.a))} and {safe_text(str(edge.b))},"
        f" {safe_text(edge.state.name.lower())} ({safe_text(edge.reason.name)}),"
        f" {safe_text(_verification_text(edge))}"
    ]
    if edge.suspicion is not None:
        lines.append(f"suspicion {edge.suspicion.value:.2f}")
        lines += [f"{doubt.weight:.2f}: {safe_text(doubt.message)}" for doubt in edge.suspicion.doubts]
        lines += [safe_text(edge.suspicion.remark)] if edge.suspicion.remark else []
    if explanation.motion is not None:
        lines.append(f"the way without it: {safe_text(explanation.motion.verdict.name)} {safe_text(explanation.motion.message)}")
    agree = sum(a.agrees for a in explanation.agreements)
    lines.append(f"{agree} other closures agree, {len(explanation.agreements) - agree} contradict")
    drawn = explanation.draw_pair().svg if explanation.picture_a is not None else ""
    return "<p>" + "<br>".join(lines) + "</p>" + drawn


def edit_html(edit: "EdgeEdit") -> str:
    """What an edit changed, or would change."""
    verb = "changed" if edit.done else "would change"
    rows = [
        {
            "closure": change.id,
            "a": change.a,
            "b": change.b,
            "before": change.before.name.lower() if change.before else "",
            "after": change.after.name.lower() if change.after else "",
            "reason": change.reason_after.name,
            "bound": change.bound,
        }
        for change in edit.changes
    ]
    columns = ("closure", "a", "b", "before", "after", "reason", "bound")
    return f"<p>{len(rows)} closures {verb}</p>" + table_html(columns, rows[:100], len(rows), "closures")
