"""The track in space and over the ground."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ftproc.derived.quantities import axes_of_north
from ftproc.records import FloatArray
from ftproc.report import style
from ftproc.report.drawing import Drawn, span
from ftproc.report.maps import graticule, ticks
from ftproc.report.style import require_plotly
from ftproc.report.thinning import Timeline
from ftproc.report.view import View

if TYPE_CHECKING:
    import plotly.graph_objects as go

COLUMNS = 2000  # intervals of time, in each of which the extremes of x, y and z are drawn
RAW_COLUMNS = 1500  # the same of the raw positions
FLATTEST = 0.2  # height over width of the figure in space; the heights of a flatter flight are enlarged,
MOST_ENLARGED = 10.0  # at most so many times: below that, room above and under it is shown
LOW = 0.4  # share of the width, up to which an axis has few numbers
NEAR = 1.0  # widths of the flight; a station within this distance is drawn too
ROOM = 0.08  # share of the flight's extent around it on the map
HEIGHT = 460
NARROWEST = 250  # CSS pixels of the map between its margins, on a telephone
FILLING = 1.3  # diagonal of the flight over the distance of the eye
NOTHING = "There is no position to draw: it is not observable."


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
    names = axis_names(view)
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
    """x and y as on a map: north up where it is known, else y. With the raw positions, ticks of time, and a grid of
    latitude and longitude where the site is known."""
    if not view.has_position:
        return Drawn(None, NOTHING)
    path, names, north = _path(view), axis_names(view), axes_of_north(view.trajectory.metadata)
    across, up = (0, 1) if north is None else north[::-1]
    go = require_plotly()
    figure = go.Figure()
    low, high = _room(path[[across, up]])
    extent = (low, high)
    graticule.add(figure, view, extent)
    dots = _raw(view, across, up, extent)
    for raw, name, mark in dots:
        figure.add_scatter(
            x=raw[0].astype(np.float32),
            y=raw[1].astype(np.float32),
            mode="markers",
            name=name,
            marker=mark,
            hoverinfo="skip",
        )
    figure.add_scatter(
        x=path[across], y=path[up], mode="lines", name="estimate", line={"color": style.BLUE, "width": 2}
    )  # fmt: skip
    _add_ticks(figure, view, (across, up), float((high - low).max()))
    for index, name, symbol in ((0, "start", "circle"), (-1, "end", "square")):
        _spot(figure, path[across, index], path[up, index], name, symbol)
    width = float(max(np.nanmax(v) - np.nanmin(v) for v in path[:2]))
    if float(np.nanmin(np.hypot(path[0], path[1]))) <= NEAR * width:
        _spot(figure, 0.0, 0.0, "station", "triangle-up-open")
        low, high = np.minimum(low, -ROOM * width), np.maximum(high, ROOM * width)
    axes = "xy"
    figure.update_layout(**style.LAYOUT, height=HEIGHT)
    title = {"standoff": 8}
    figure.update_xaxes(
        **style.axis(title={"text": names[axes[across]], **title}, nticks=4, tickangle=0, range=[low[0], high[0]])
    )
    figure.update_yaxes(
        **style.axis(
            title={"text": names[axes[up]], **title}, nticks=8, scaleanchor="x", scaleratio=1, range=[low[1], high[1]]
        )
    )
    known = " Dots: the position that each row of the log shows; some lie outside." if dots else ""
    return Drawn(figure, f"Over the ground: equal scales; circle: start, square: end, triangle: station.{known}")


def axis_names(view: View) -> dict[str, str]:
    """The titles of the axes, with their directions as far as they are known."""
    north = axes_of_north(view.trajectory.metadata)
    names = {} if north is None else {"xy"[north[0]]: "north", "xy"[north[1]]: "east"}
    return {axis: f"{axis} ({names[axis]}), m" if axis in names else f"{axis}, m" for axis in "xy"} | {"z": "z (up), m"}


def _spot(figure: go.Figure, x: float, y: float, name: str, symbol: str) -> None:
    marker: dict[str, Any] = {"color": style.BLACK, "symbol": symbol, "size": 9}
    figure.add_scatter(x=[x], y=[y], mode="markers", name=name, marker=marker, showlegend=False)


def _room(path: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The least and the greatest (2,) of a path (2, m) on the map, with some room."""
    width = max(float(np.ptp(axis[np.isfinite(axis)])) for axis in path) or 1.0
    ends = np.array([span(axis, margin=0.0) for axis in path])
    return ends[:, 0] - ROOM * width, ends[:, 1] + ROOM * width


def _add_ticks(figure: go.Figure, view: View, axes: tuple[int, int], width: float) -> None:
    """Round moments along the track, with the names of those that have room for one. width: of the map, m."""
    trajectory = view.trajectory
    rows, said = ticks.along(view.moments, trajectory.time_s)
    position = trajectory.state[rows][:, list(axes)]
    if not np.isfinite(position).any():
        return
    mark = {"color": style.BLUE, "symbol": "line-ns-open", "size": 9, "line": {"width": 2}}
    inward = np.where(position[:, 0] > np.nanmean(position[:, 0]), "top left", "top right").tolist()
    figure.add_scatter(
        x=position[:, 0], y=position[:, 1], mode="markers+text", name="time", marker=mark, hovertext=said,
        hoverinfo="text", text=ticks.apart(said, position * NARROWEST / width), textfont={"size": 11},
        textposition=inward, showlegend=False, cliponaxis=True,
    )  # fmt: skip


def _raw(
    view: View, across: int, up: int, extent: tuple[FloatArray, FloatArray]
) -> list[tuple[FloatArray, str, dict[str, Any]]]:
    """(2, m) raw positions on the map inside its extent, thinned, of rows whose readings are all good and of others."""
    position, bad = view.raw_position
    if position is None:
        return []
    position = position[:, [across, up]]
    inside = np.asarray(((position >= extent[0]) & (position <= extent[1])).all(1))
    timeline = Timeline.of(view.trajectory.time_s, RAW_COLUMNS)
    found = list[tuple[FloatArray, str, dict[str, Any]]]()
    for chosen, name, colour, size in (
        (inside & ~bad, "raw position", style.READING, 2.5), (inside & bad, "with an outlier", style.VERMILLION, 3.5),
    ):  # fmt: skip
        shown = np.where(chosen[:, None], position, np.nan).T
        rows = timeline.extremes(*shown)
        if len(rows):
            found.append((shown[:, rows], name, {"color": colour, "size": size, "opacity": 0.7}))
    return found


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
