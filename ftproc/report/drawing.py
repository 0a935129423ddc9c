"""Elements of the figures: rows of plots over one time axis, lines, dots and marks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ftproc.records import FloatArray, IntArray
from ftproc.report import style
from ftproc.report.patches import Step
from ftproc.report.style import require_plotly
from ftproc.report.thinning import Timeline

if TYPE_CHECKING:
    import plotly.graph_objects as go

EDGE = 0.01  # of the duration, free before and after it
FEW = 30  # samples, up to which a line has dots
MANY_MARKS = 3000  # from which WebGL draws them
CROWDED, SMALLER = (300, 3000), 0.7  # numbers of marks from which they shrink, each time by this factor
LABEL_PX, LABELS_BELOW = 14, 3  # of height, and labels of steps that are put below each other
DASHES = ("solid", "dash", "dot")  # of x, y, z, which differ in print too


class Drawn(NamedTuple):
    """figure: None without data. note: what it shows, or why there is none."""

    figure: go.Figure | None
    note: str


def rows(timeline: Timeline, titles: Sequence[str], height: int, columns: int = 1) -> go.Figure:
    """An empty figure of plots below each other over the times of the log; titles of their y axes, row by row."""
    require_plotly()
    from plotly.subplots import make_subplots

    count = len(titles) // columns
    figure = make_subplots(
        count, columns, shared_xaxes="all", vertical_spacing=0.16 / count, horizontal_spacing=0.13
    )  # fmt: skip
    figure.update_layout(**style.LAYOUT, height=height, meta={"time": True, "columns": columns})
    figure.update_xaxes(**style.axis(range=span(timeline.time_s, margin=EDGE)))
    for index, title in enumerate(titles):
        row, column = divmod(index, columns)
        figure.update_yaxes(**style.axis(title={"text": title, "standoff": 8}), row=row + 1, col=column + 1)
    for column in range(columns):
        figure.update_xaxes(title_text=style.TIME, row=count, col=column + 1)
    return figure


def add(figure: go.Figure, trace: Any, row: int = 0, column: int = 0, first: bool = True) -> None:
    """Add a trace to a row (from 0). A name is once in the legend, and a click there hides all its traces."""
    trace.update(legendgroup=trace.name, showlegend=first)
    figure.add_trace(trace, row=row + 1, col=column + 1)


def line(timeline: Timeline, value: FloatArray, name: str, colour: str, dash: str = "solid", width: float = 1.5) -> Any:
    """A thinned line of (n,) values, broken at gaps and missing values."""
    return _joined(*timeline.line(value), name, {"color": colour, "width": width, "dash": dash})


def dots(timeline: Timeline, value: FloatArray, name: str, colour: str) -> Any:
    """(n,) values as small dots; when too many, a line through their extremes, which appears the same."""
    if timeline.thinned:
        return _joined(*timeline.line(value, over_missing=True), name, {"color": colour, "width": 1})
    chosen = timeline.extremes(value)
    return require_plotly().Scatter(
        x=timeline.time_s[chosen], y=value[chosen].astype(np.float32), name=name, mode="markers",
        marker={"color": colour, "size": 3.5},
    )  # fmt: skip


def _joined(x: FloatArray, y: FloatArray, name: str, drawn: dict[str, Any]) -> Any:
    mode = "lines+markers" if len(x) <= FEW else "lines"  # a line of one point is invisible
    return require_plotly().Scatter(x=x, y=y.astype(np.float32), name=name, mode=mode, line=drawn, marker={"size": 4})


def level(timeline: Timeline, value: float, name: str, dash: str = "dash") -> Any:
    """A limit, from the first to the last time."""
    return require_plotly().Scatter(
        x=timeline.time_s[[0, -1]], y=[value, value], name=name, mode="lines", hoverinfo="skip",
        line={"color": style.LIMIT, "width": 1, "dash": dash},
    )  # fmt: skip


def marks(
    time_s: FloatArray, value: FloatArray, chosen: IntArray, kind: style.Kind, limits: tuple[float, float], total: int
) -> Any:
    """Marks of a kind at the chosen of (n,) values. One beyond the limits is drawn at them, with its value in the hover
    text. total: marks in the whole figure."""
    go = require_plotly()
    y = value[chosen].astype(np.float32)
    inside = np.clip(y, np.float32(limits[0]), np.float32(limits[1]))
    beyond = {} if np.array_equal(y, inside, equal_nan=True) else {"customdata": y}
    shown = "%{customdata:.6~g}" if beyond else "%{y:.6~g}"
    size = kind.marker["size"] * SMALLER ** sum(total > limit for limit in CROWDED)
    return (go.Scattergl if total > MANY_MARKS else go.Scatter)(
        x=time_s[chosen], y=inside, name=kind.name, mode="markers", marker={**kind.marker, "size": size}, **beyond,
        hovertemplate=f"%{{x:.6~f}} s<br>{shown}<extra>{kind.name}</extra>",
    )  # fmt: skip


def step_lines(figure: go.Figure, steps: Sequence[Step], row: int, column: int = 0, labelled: bool = True) -> None:
    """Upright lines where steps were taken out, through the plot in a row (from 0); with what happened beside them."""
    for number, step in enumerate(steps):
        label = {"text": step.words, "font": {"size": 11, "color": style.PURPLE}, "bgcolor": "rgba(255,255,255,0.8)"}
        after = step.time_s < np.mean(figure.layout.xaxis.range)  # on the side with more room
        figure.add_vline(
            step.time_s, row=row + 1, col=column + 1, line={"color": style.PURPLE, "width": 1.2, "dash": "dashdot"},
            **({"annotation": label, "annotation_position": f"top {'right' if after else 'left'}",
                "annotation_yshift": -LABEL_PX * (number % LABELS_BELOW)} if labelled else {}),
        )  # fmt: skip


def span(*values: FloatArray, margin: float) -> tuple[float, float]:
    """The least and the greatest of the values, with a margin (share of their distance); (-1, 1) without values."""
    there = np.concatenate([v[np.isfinite(v)] for v in values])
    if not len(there):
        return -1.0, 1.0
    low, high = float(there.min()), float(there.max())
    extra = margin * ((high - low) or abs(high) or 1.0)
    return low - extra, high + extra
