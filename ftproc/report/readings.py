"""The readings with the estimate and the flags, and their residuals."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ftproc.records import ACCEPTED, COMPONENTS, GOOD, ISOLATED, MISSING, PATCH, REJECTED, FloatArray, IntArray
from ftproc.report import drawing, style
from ftproc.report.drawing import Drawn
from ftproc.report.patches import steps, worst
from ftproc.report.thinning import MOST_MARKED
from ftproc.report.view import View

ROW_HEIGHT = 190
ROOM = 0.35  # share of the trajectory's extent, above and below it, where outliers are drawn
FOOT = 0.08  # share of the height, below the lowest outlier, where missing readings are marked
LARGEST = 3.0  # gates; larger residuals are drawn there
LARGEST_SIGMAS = 12.0  # the same where the gate is not known

#: Flags of readings that are marked, and what a click on one decides.
_MARKED = {ISOLATED: "good", PATCH: "good", REJECTED: "auto", ACCEPTED: "auto"}

CLOCK = "clock"  # a step of it

NO_RESIDUALS = "This method publishes no residuals with sigmas."
NOT_KNOWN = "A trajectory file does not hold the raw readings; the page of `ftproc filter --report` shows them."
_WHAT = {
    "innovation": "Innovation: the reading minus its prediction from the readings before it",
    "leave-one-out residual": "Leave-one-out residual: the reading minus its estimate from all other readings",
}


def readings(view: View) -> Drawn:
    """R, A and E over time: raw, cleaned, flagged."""
    raw = view.cleaned if view.reading is None else view.reading
    seen = [c for c in range(len(COMPONENTS)) if np.isfinite(raw[:, c]).any() or np.isfinite(view.cleaned[:, c]).any()]
    if not seen:
        return Drawn(None, NOT_KNOWN)
    figure = drawing.rows(view.timeline, [style.COMPONENT[c].title for c in seen], _height(seen))
    timeline, flags = view.timeline, view.trajectory.outlier
    chosen, note = _marked(view, raw, seen)
    total = sum(map(len, chosen.values()))
    named: set[str] = set()
    for row, c in enumerate(seen):
        good = np.where(flags[:, c] == GOOD, raw[:, c], np.nan)
        limits = drawing.span(view.cleaned[:, c], good, margin=ROOM)
        foot = limits[0] - FOOT * (limits[1] - limits[0])
        traces = [] if view.reading is None else [drawing.dots(timeline, good, "good reading", style.READING)]
        for flag, kind in style.KINDS.items():
            value = _marked_at(view, raw, c, flag, foot)
            within = (foot, limits[1]) if flag == MISSING else limits
            traces.append(drawing.marks(timeline.time_s, value, chosen[flag, c], kind, within, total))
        traces.append(drawing.line(timeline, view.cleaned[:, c], "estimate", style.ESTIMATE))
        _add(figure, _decidable(traces, c), row, named)
        _add_steps(figure, view, row, c)
    where = "An outlier beyond the axis is drawn at its edge; point at it for its value."
    if view.reading is None:
        where = f"{NOT_KNOWN} Outliers are marked at the estimate."
    return Drawn(figure, f"{where} {note}".strip())


def worst_seconds(view: View) -> Drawn:
    """The same, of the seconds with most outliers only."""
    found = worst(view)
    if found is None:
        return Drawn(None, "There are no outliers, or the whole log is as short.")
    first, last = np.searchsorted(view.trajectory.time_s, found).tolist()
    return readings(view.part(slice(first, max(last, first + 1))))


def residuals(view: View) -> Drawn:
    """Residuals in units of their sigma, with the gate."""
    known = view.diagnostics
    if known is None:
        return Drawn(None, NOT_KNOWN)
    with np.errstate(invalid="ignore", divide="ignore"):
        scaled = known.residual / known.residual_sigma
    seen = [c for c in range(len(COMPONENTS)) if np.isfinite(scaled[:, c]).any()]
    if not seen:
        return Drawn(None, NO_RESIDUALS)
    figure = drawing.rows(view.timeline, [f"{style.COMPONENT[c].label}, sigmas" for c in seen], _height(seen))
    timeline, flags, gate = view.timeline, view.trajectory.outlier, view.gate
    largest = LARGEST_SIGMAS if gate is None else LARGEST * gate
    named: set[str] = set()
    for row, c in enumerate(seen):
        parts = {flag: np.where(flags[:, c] == flag, scaled[:, c], np.nan) for flag in (GOOD, *_MARKED)}
        traces = [drawing.dots(timeline, parts[GOOD], "good reading", style.READING)]
        for flag in _MARKED:
            at = timeline.extremes(parts[flag])
            limits = (-largest, largest)
            traces.append(
                drawing.marks(timeline.time_s, parts[flag], at, style.KINDS[flag], limits, len(seen) * len(at))
            )
        if gate is not None:
            traces += [drawing.level(timeline, sign * gate, f"gate of {gate:g} sigmas") for sign in (-1, 1)]
        _add(figure, _decidable(traces, c), row, named)
        _add_steps(figure, view, row, c)
    note = "Decisions also rest on neighbouring readings: some inside the gate are outliers, some outside are not."
    if view.trajectory.metadata.get("settings", {}).get("editing") == "none":
        note = "No reading was edited: the gate was not used."
    if steps(view):
        note += " A step is taken out of the readings on its shorter side."
    return Drawn(figure, f"{_WHAT[known.residual_kind]}. {note}")


def _decidable(traces: list[Any], c: int) -> list[Any]:
    """The traces, of which those of readings say what a click on one means."""
    uses = {"good reading": "bad", **{style.KINDS[flag].name: use for flag, use in _MARKED.items()}}
    for trace in traces:
        if trace.name in uses:
            trace.meta = {"component": COMPONENTS[c], "use": uses[trace.name]}
    return traces


def _height(seen: list[int]) -> int:
    return 70 + ROW_HEIGHT * len(seen)


def _add(figure: Any, traces: Iterable[Any], row: int, named: set[str]) -> None:
    """Add the traces that have points; each name once in the legend."""
    for trace in traces:
        if len(trace.x):
            drawing.add(figure, trace, row, first=trace.name not in named)
            named.add(trace.name)


def _add_steps(figure: Any, view: View, row: int, c: int) -> None:
    """Lines at the steps of a component, and of the clock, which moves all of them."""
    own = [step for step in steps(view) if step.component in (COMPONENTS[c], CLOCK)]
    drawing.step_lines(figure, own, row)


def _marked_at(view: View, raw: FloatArray, c: int, flag: int, foot: float) -> FloatArray:
    """(n,) height at which readings with the flag are marked: their value, or the foot for missing ones."""
    if flag == MISSING:
        return np.full(len(raw), foot)
    return np.where(np.isfinite(raw[:, c]), raw[:, c], view.cleaned[:, c])


def _marked(view: View, raw: FloatArray, seen: list[int]) -> tuple[dict[tuple[int, int], IntArray], str]:
    """The flagged readings that are marked, by flag and component, and a sentence when these are not all."""
    flags = view.trajectory.outlier
    every = {(flag, c): np.flatnonzero(flags[:, c] == flag) for flag in style.KINDS for c in seen}
    total = sum(map(len, every.values()))
    if total <= MOST_MARKED:
        return every, ""
    chosen = {}
    for (flag, c), rows in every.items():
        value = np.full(len(flags), np.nan)
        value[rows] = _marked_at(view, raw, c, flag, 0.0)[rows]
        chosen[flag, c] = view.timeline.extremes(value)
    drawn = sum(map(len, chosen.values()))
    return chosen, f"Of {total:,} flagged readings {drawn:,} are marked, the extremes of each pixel column."
