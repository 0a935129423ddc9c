"""The readings with the estimate and the flags, and their residuals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ftproc.records import ACCEPTED, GOOD, ISOLATED, MISSING, PATCH, REJECTED, FloatArray, IntArray
from ftproc.report import drawing, style
from ftproc.report.drawing import Drawn
from ftproc.report.patches import steps, worst
from ftproc.report.thinning import MOST_MARKED, Timeline
from ftproc.report.view import Channel, View, apart

ROW_HEIGHT = 190
ROOM = 0.35  # share of the trajectory's extent, above and below it, where outliers are drawn
FOOT = 0.08  # share of the height, below the lowest outlier, where missing readings are marked
LARGEST = 3.0  # gates; larger residuals are drawn there
LARGEST_SIGMAS = 12.0  # the same where the gate is not known

#: Flags of readings that are marked, and what a click on one decides.
_MARKED = {ISOLATED: "good", PATCH: "good", REJECTED: "auto", ACCEPTED: "auto"}

CLOCK = "clock"  # a step of it

NO_RESIDUALS = "This method publishes no residuals with sigmas."
NOT_KNOWN = "Trajectory files and streams do not keep the raw readings; `ftproc filter LOG --report` shows them."
_WHAT = {
    "innovation": "Innovation: the reading minus its prediction from the readings before it",
    "leave-one-out residual": "Leave-one-out residual: the reading minus its estimate from all other readings",
}


def readings(view: View) -> Drawn:
    """Each channel over time: raw, cleaned, flagged."""
    return _drawn(view, slice(None))


def worst_seconds(view: View) -> Drawn:
    """The same, of the seconds with most outliers only."""
    found = worst(view)
    if found is None:
        return Drawn(None, "There are no outliers, or the whole log is as short.")
    first, last = np.searchsorted(view.trajectory.time_s, found).tolist()
    return _drawn(view, slice(first, max(last, first + 1)))


def _drawn(view: View, rows: slice) -> Drawn:
    """Of some rows."""
    seen = [c.rows(rows) for c in view.channels if np.isfinite(c.drawn).any()]
    if not seen:
        return Drawn(None, NOT_KNOWN)
    timeline = view.timeline if rows == slice(None) else Timeline.of(view.trajectory.time_s[rows])
    figure = drawing.rows(timeline, [channel.quantity.title for channel in seen], _height(seen))
    chosen, note = _marked(timeline, seen)
    total = sum(map(len, chosen.values()))
    named: set[str] = set()
    for row, channel in enumerate(seen):
        good = np.where(channel.flags == GOOD, channel.drawn, np.nan)
        limits = drawing.span(channel.cleaned, good, margin=ROOM)
        foot = limits[0] - FOOT * (limits[1] - limits[0])
        traces = [drawing.dots(timeline, good, "good reading", style.READING)] if view.has_readings else []
        for flag, kind in style.KINDS.items():
            within = (foot, limits[1]) if flag == MISSING else limits
            value = _marked_at(channel, flag, foot)
            traces.append(drawing.marks(timeline.time_s, value, chosen[flag, row], kind, within, total))
        traces.append(drawing.line(timeline, channel.cleaned, "estimate", style.ESTIMATE))
        _add(figure, _decidable(traces, channel), row, named)
        _add_steps(figure, view, timeline, row, channel)
    where = "An outlier beyond the axis is drawn at its edge; point at it for its value."
    if not view.has_readings:
        where = f"{NOT_KNOWN} Outliers are marked at the estimate."
    return Drawn(figure, f"{where} {note}".strip())


def residuals(view: View) -> Drawn:
    """Residuals in units of their sigma, with the gate."""
    known = view.diagnostics
    if known is None:
        return Drawn(None, NOT_KNOWN)
    seen = [(channel, scaled) for channel in view.channels if np.isfinite(scaled := _known(channel)).any()]
    if not seen:
        return Drawn(None, NO_RESIDUALS)
    titles = [f"{channel.quantity.label}, sigmas" for channel, _ in seen]
    figure = drawing.rows(view.timeline, titles, _height(seen))
    timeline, gate = view.timeline, view.gate
    largest = LARGEST_SIGMAS if gate is None else LARGEST * gate
    named: set[str] = set()
    for row, (channel, scaled) in enumerate(seen):
        parts = {flag: np.where(channel.flags == flag, scaled, np.nan) for flag in (GOOD, *_MARKED)}
        traces = [drawing.dots(timeline, parts[GOOD], "good reading", style.READING)]
        for flag in _MARKED:
            at = timeline.extremes(parts[flag])
            limits = (-largest, largest)
            traces.append(
                drawing.marks(timeline.time_s, parts[flag], at, style.KINDS[flag], limits, len(seen) * len(at))
            )
        if gate is not None:
            traces += [drawing.level(timeline, sign * gate, f"gate of {gate:g} sigmas") for sign in (-1, 1)]
        _add(figure, _decidable(traces, channel), row, named)
        _add_steps(figure, view, timeline, row, channel)
    note = "Decisions also rest on neighbouring readings: some inside the gate are outliers, some outside are not."
    if view.trajectory.metadata.get("settings", {}).get("editing") == "none":
        note = "No reading was edited: the gate was not used."
    if steps(view):
        note += " A step is taken out of the readings on its shorter side."
    if known.residual_kind != "innovation" and (names := known.beside.keys() & apart(view.trajectory)):
        note += f" Those of {' and '.join(sorted(name.replace('_', ' ') + 's' for name in names))} are innovations."
    return Drawn(figure, f"{_WHAT[known.residual_kind]}. {note}")


def _known(channel: Channel) -> FloatArray:
    return np.full(len(channel.flags), np.nan) if channel.scaled is None else channel.scaled


def _decidable(traces: list[Any], channel: Channel) -> list[Any]:
    """The traces, of which those of readings say what a click on one means."""
    uses = {"good reading": "bad", **{style.KINDS[flag].name: use for flag, use in _MARKED.items()}}
    for trace in traces:
        if trace.name in uses:
            trace.meta = {"component": channel.name, "use": uses[trace.name]}
    return traces


def _height(seen: Sequence[Any]) -> int:
    return 70 + ROW_HEIGHT * len(seen)


def _add(figure: Any, traces: Iterable[Any], row: int, named: set[str]) -> None:
    """Add the traces that have points; each name once in the legend."""
    for trace in traces:
        if len(trace.x):
            drawing.add(figure, trace, row, first=trace.name not in named)
            named.add(trace.name)


def _add_steps(figure: Any, view: View, timeline: Timeline, row: int, channel: Channel) -> None:
    """Lines at the steps of a channel, and of the clock, which moves all of them, within the times drawn."""
    own = [step for step in steps(view, timeline.time_s) if step.component in (channel.name, CLOCK)]
    drawing.step_lines(figure, own, row)


def _marked_at(channel: Channel, flag: int, foot: float) -> FloatArray:
    """(n,) height at which readings with the flag are marked: their value, or the foot for missing ones."""
    if flag == MISSING:
        return np.full(len(channel.flags), foot)
    return np.where(np.isfinite(channel.drawn), channel.drawn, channel.cleaned)


def _marked(timeline: Timeline, seen: Sequence[Channel]) -> tuple[dict[tuple[int, int], IntArray], str]:
    """The flagged readings that are marked, by flag and channel, and a sentence when these are not all."""
    every = {(flag, row): np.flatnonzero(each.flags == flag) for flag in style.KINDS for row, each in enumerate(seen)}
    total = sum(map(len, every.values()))
    if total <= MOST_MARKED:
        return every, ""
    chosen = {}
    for (flag, row), rows in every.items():
        value = np.full(len(timeline.time_s), np.nan)
        value[rows] = _marked_at(seen[row], flag, 0.0)[rows]
        chosen[flag, row] = timeline.extremes(value)
    drawn = sum(map(len, chosen.values()))
    return chosen, f"Of {total:,} flagged readings {drawn:,} are marked, the extremes of each pixel column."
