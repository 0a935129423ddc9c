"""The track in space and over the ground."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ftproc.records import FloatArray
from ftproc.report import style
from ftproc.report.drawing import Drawn
from ftproc.report.style import require_plotly
from ftproc.report.thinning import Timeline
from ftproc.report.view import View

if TYPE_CHECKING:
    import plotly.graph_objects as go

COLUMNS = 2000  # intervals of time, in each of which the extremes of x, y and z are drawn
FLATTEST = 0.2  # height over width of the figure in space; the heights of a flatter flight are enlarged,
MOST_ENLARGED = 10.0  # at most so many times: below that, room above and under it is shown
LOW = 0.4  # share of the width, up to which an axis has few numbers
NEAR = 1.0  # widths of the flight; a station within this distance is drawn too
HEIGHT = 460
FILLING = 1.3  # diagonal of the flight over the distance of the eye
NOTHING = "There is no position to draw: it is not observable."

_NORTH = {"x": "x (north), m", "y": "y (east), m", "z": "z (up), m"}
_LOCAL = {"x": "x, m", "y": "y, m", "z": "z (up), m"}


def track(view: View) -> Drawn:
    """x, y and z."""
    if not view.has_position:
        return Drawn(None, NOTHING)
    x, y, z = _path(view)
    size = np.array([np.nanmax(v) - np.nanmin(v) for v in (x, y, z)])
    widest = max(float(size.max()), 1e-9)
    size[2] = max(size[2], FLATTEST / MOST_ENLARGED * widest)
    share = np.maximum(size / widest, [0.02, 0.02, FLATTEST])
    middle, room = (np.nanmin(z) + np.nanmax(z)) / 2, 0.52 * size[2]
    scale = FILLING / float(np.linalg.norm(share))
    names = _names(view)
    go = require_plotly()
    figure = go.Figure(
        go.Scatter3d(x=x, y=y, z=z, mode="lines", name="estimate", line={"color": style.BLUE, "width": 4})
    )
    for index, name, symbol in ((0, "start", "circle"), (-1, "end", "square")):
        figure.add_scatter3d(
            x=x[[index]], y=y[[index]], z=z[[index]], mode="markers", name=name,
            marker={"color": style.BLACK, "symbol": symbol, "size": 4},
        )  # fmt: skip
    axes = {f"{a}axis": {"title": {"text": names[a]}, "gridcolor": style.GRID, "exponentformat": "none",
                         "separatethousands": True, "nticks": 5 if length > LOW else 3, "showspikes": False}
            for a, length in zip("xyz", share, strict=True)}  # fmt: skip
    scene = {**axes, "aspectmode": "manual", "aspectratio": dict(zip("xyz", scale * share, strict=True)),
             "camera": {"eye": {"x": -1.1, "y": -1.3, "z": 0.8}, "center": {"x": 0, "y": 0, "z": -0.12}}}  # fmt: skip
    figure.update_scenes(zaxis_range=[float(middle - room), float(middle + room)])
    figure.update_layout(**{**style.LAYOUT, "margin": {"l": 0, "r": 0, "t": 30, "b": 0}}, scene=scene, height=HEIGHT)
    raised = share[2] * widest / size[2]
    factor = float(f"{raised:.2g}")
    note = "equal scales" if raised < 1.01 else f"heights enlarged {factor:g} times against x and y"
    return Drawn(figure, f"In space: {note}. Drag to turn it.")


def ground(view: View) -> Drawn:
    """x and y as on a map: north up where the frame has north, else y."""
    if not view.has_position:
        return Drawn(None, NOTHING)
    path, names = _path(view), _names(view)
    across, up = (1, 0) if names is _NORTH else (0, 1)
    go = require_plotly()
    figure = go.Figure()
    figure.add_scatter(
        x=path[across], y=path[up], mode="lines", name="estimate", line={"color": style.BLUE, "width": 2}
    )  # fmt: skip
    for index, name, symbol in ((0, "start", "circle"), (-1, "end", "square")):
        _spot(figure, path[across, index], path[up, index], name, symbol)
    width = float(max(np.nanmax(v) - np.nanmin(v) for v in path[:2]))
    if float(np.nanmin(np.hypot(path[0], path[1]))) <= NEAR * width:
        _spot(figure, 0.0, 0.0, "station", "triangle-up-open")
    axes = "xy"
    figure.update_layout(**style.LAYOUT, height=HEIGHT)
    figure.update_xaxes(**style.axis(title={"text": names[axes[across]], "standoff": 8}, nticks=4, tickangle=0))
    figure.update_yaxes(
        **style.axis(title={"text": names[axes[up]], "standoff": 8}, nticks=8, scaleanchor="x", scaleratio=1)
    )  # fmt: skip
    return Drawn(figure, "Over the ground: equal scales.")


def _spot(figure: go.Figure, x: float, y: float, name: str, symbol: str) -> None:
    marker: dict[str, Any] = {"color": style.BLACK, "symbol": symbol, "size": 9}
    figure.add_scatter(x=[x], y=[y], mode="markers", name=name, marker=marker)


def _names(view: View) -> dict[str, str]:
    return _NORTH if view.trajectory.metadata.get("frame") == "north-east-up" else _LOCAL


def _path(view: View) -> FloatArray:
    """(3, m) thinned x, y, z in m with the first and the last, NaN where broken."""
    state = view.trajectory.state
    there = np.asarray(np.isfinite(state[:, :3]).all(1))
    timeline = Timeline.of(view.trajectory.time_s, COLUMNS)
    position = np.where(there[:, None], state[:, :3], np.nan).T
    chosen = timeline.extremes(*position)
    ends = np.flatnonzero(there)[[0, -1]]
    chosen = np.union1d(chosen, ends)
    found: FloatArray = np.array([timeline.broken(chosen, axis)[1] for axis in position], np.float32)
    return found
