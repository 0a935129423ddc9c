"""The figures of a fused flight."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow.compute as pc

from ftproc.core.model.frames import to_cartesian
from ftproc.files.moments import Moments
from ftproc.fusion import findings
from ftproc.fusion.estimation import constants
from ftproc.fusion.estimation.events import CLOCK
from ftproc.fusion.estimation.whole import Fused
from ftproc.fusion.flight import Flight
from ftproc.records import COMPONENTS, FloatArray
from ftproc.report import style
from ftproc.report.drawing import Drawn, add, dots, level, marks, rows
from ftproc.report.maps.track import COLUMNS, HEIGHT
from ftproc.report.style import require_plotly
from ftproc.report.thinning import Timeline

if TYPE_CHECKING:
    import plotly.graph_objects as go

PALETTE = (style.BLUE, style.ORANGE, style.GREEN, style.PURPLE, style.SKY, style.VERMILLION)
SIGHTS = 12  # lines of sight that are drawn of each station
ROW_PX, BAR_PX, BIAS_PX = 130, 34, 26  # of height
LIMIT = 8.0  # sigmas, at which farther residuals are drawn
PIECES = 400  # of the flight, each of which a station has or has not carried


def colour(s: int) -> str:
    """Of a station, by its number."""
    return PALETTE[s % len(PALETTE)]


def station_map(flight: Flight, fused: Fused) -> Drawn:
    """The track over the ground, the stations, and lines of sight to the track."""
    go = require_plotly()
    figure = go.Figure()
    state = flight.trajectory.state
    timeline = Timeline.of(flight.trajectory.time_s, COLUMNS)
    chosen = timeline.extremes(state[:, 0], state[:, 1])
    for s, station in enumerate(fused.stations):
        x, y = _sights(fused, s)
        line = {"color": colour(s), "width": 0.7}
        figure.add_scatter(x=x, y=y, mode="lines", name=f"sight of {station.name}", line=line, hoverinfo="skip")
    x, y = (timeline.broken(chosen, state[:, axis])[1] for axis in (0, 1))
    figure.add_scatter(x=x, y=y, mode="lines", name="estimate", line={"color": style.BLACK, "width": 2})
    for s, station in enumerate(fused.stations):
        figure.add_scatter(
            x=[station.place[0]], y=[station.place[1]], mode="markers+text", name=station.name, text=[station.name],
            textposition="bottom center", showlegend=False, cliponaxis=False,
            marker={"color": colour(s), "symbol": "triangle-up", "size": 11},
        )  # fmt: skip
    figure.update_layout(**style.LAYOUT, height=HEIGHT)
    figure.update_xaxes(**style.axis(title={"text": "x (east), m", "standoff": 8}, nticks=4, tickangle=0))
    figure.update_yaxes(
        **style.axis(title={"text": "y (north), m", "standoff": 8}, nticks=8, scaleanchor="x", scaleratio=1)
    )
    return Drawn(figure, "Over the ground: equal scales. Thin lines: readings that were used, evenly picked over time.")


def _sights(fused: Fused, s: int) -> tuple[FloatArray, FloatArray]:
    """x and y of lines from a station along used readings to the track, with breaks."""
    station = fused.stations[s]
    used = np.flatnonzero((fused.weight[s] > 0).any(1))
    chosen = used[np.linspace(0, len(used) - 1, min(SIGHTS, len(used))).astype(int)] if len(used) else used
    target = fused.position[s][chosen]
    reading = station.measurement[chosen] - fused.constants.estimate[s, :3]
    away = np.linalg.norm(target - station.place, axis=1)
    seen = np.asarray((fused.weight[s][chosen, 1:] > 0).all(1))
    reading[:, 0] = away
    ends = np.where(seen[:, None], station.place + to_cartesian(reading) @ fused.axes[s], target)
    x, y = (
        np.stack([np.full(len(ends), station.place[a]), ends[:, a], np.full(len(ends), np.nan)], 1).ravel()
        for a in (0, 1)
    )
    return x, y


def log_clocks(flight: Flight, fused: Fused) -> dict[str, float]:
    """For each station, s from the times of the page to those of its log."""
    starts = {name: pc.min(table.column("time_s")).as_py() for name, table in flight.edited.items()}
    first = [float(each.time_s.min()) - fused.constants.estimate[s, CLOCK] for s, each in enumerate(fused.stations)]
    return {
        each.name: float(starts[each.name] - first[s] - flight.zero_s) for s, each in enumerate(fused.stations)
    }  # fmt: skip


def residuals(flight: Flight, fused: Fused) -> Drawn:
    """Leave-one-out residuals of each component of each station in their sigmas; the rejected ones marked."""
    shown = [(s, c) for s, station in enumerate(fused.stations) for c in station.components]
    titles = [f"{fused.stations[s].name} {COMPONENTS[c][:2]}" for s, c in shown]
    timeline = Timeline.of(fused.track.time_s + flight.zero_s)
    figure, clocks = rows(timeline, titles, 80 + ROW_PX * len(shown)), log_clocks(flight, fused)
    rejected = sum(int(((w == 0) & (p > 0)).sum()) for w, p in zip(fused.weight, fused.possible, strict=True))
    for row, (s, c) in enumerate(shown):
        time_s = fused.stations[s].time_s - fused.constants.estimate[s, CLOCK] + flight.zero_s
        scaled = fused.residual[s][:, c] / np.sqrt(fused.residual_variance[s][:, c])
        used = fused.weight[s][:, c] > 0
        own, name = Timeline.of(time_s), fused.stations[s].name
        whose = {"component": COMPONENTS[c], "station": name, "clock": clocks[name]}
        trace = dots(own, np.where(used, scaled, np.nan), "used", style.GREY)
        trace.meta = {**whose, "use": "bad"}
        add(figure, trace, row, first=row == 0)
        out = np.flatnonzero(~used & np.isfinite(scaled))
        kind = style.KINDS[1]._replace(name="rejected")
        if len(out):
            trace = marks(time_s, scaled, out, kind, (-LIMIT, LIMIT), rejected)
            trace.meta = {**whose, "use": "good"}
            add(figure, trace, row, first=row == 0)
        for limit in (-3.0, 3.0):
            add(figure, level(own, limit, "3 sigma"), row, first=row == 0 and limit < 0)
        figure.update_yaxes(range=[-1.05 * LIMIT, 1.05 * LIMIT], row=row + 1, col=1)
    return Drawn(figure, "Reading minus what all others say of it, over the sigma that is expected of that.")


def biases(flight: Flight, fused: Fused) -> Drawn:
    """Each bias in units of what was known beforehand: 1 sigma before as a wide bar, estimate and 1 sigma after."""
    go = require_plotly()
    c = fused.constants
    shown = [(s, j) for s in range(len(fused.stations)) for j in range(len(constants.NAMES)) if c.prior[s, j] > 0]
    if not shown:
        return Drawn(None, "All biases and clocks were known beforehand.")
    names = [f"{fused.stations[s].name}: {constants.WORDS[j]}" for s, j in shown][::-1]
    value = np.array([c.estimate[s, j] / c.prior[s, j] for s, j in shown])[::-1]
    sigma = np.array([c.sigma[s, j] / c.prior[s, j] for s, j in shown])[::-1]
    figure = go.Figure()
    figure.add_bar(
        x=np.full(len(names), 2.0), base=-1.0, y=names, orientation="h", name="1 sigma before",
        marker={"color": style.BAND}, hoverinfo="skip",
    )  # fmt: skip
    figure.add_scatter(
        x=value, y=names, mode="markers", name="estimate and 1 sigma after",
        error_x={"type": "data", "array": sigma, "color": style.BLUE}, marker={"color": style.BLUE, "size": 6},
    )  # fmt: skip
    figure.update_layout(
        **{**style.LAYOUT, "margin": {"l": 210, "r": 44, "t": 36, "b": 46}}, height=90 + BIAS_PX * len(names)
    )
    figure.update_xaxes(**style.axis(title={"text": "in 1-sigmas of before", "standoff": 8}))
    figure.update_yaxes(**style.axis(tickmode="linear", dtick=1))
    return Drawn(figure, "Reading minus truth; azimuths anticlockwise from east, clocks log minus true time.")


def carried(flight: Flight, fused: Fused) -> Drawn:
    """Which station carried which stretch: by the number of its readings that are used, piece by piece."""
    go = require_plotly()
    begin, end = (float(fused.track.time_s[k]) for k in (0, -1))
    edges = np.linspace(begin, end, PIECES + 1)
    middle = 0.5 * (edges[1:] + edges[:-1]) + flight.zero_s
    names, share, rejected = [], [], []
    for s, station in enumerate(fused.stations):
        time_s = station.time_s - fused.constants.estimate[s, CLOCK]
        piece = np.clip(np.searchsorted(edges, time_s, side="right") - 1, 0, PIECES - 1)
        names.append(station.name)
        share.append(np.bincount(piece, (fused.weight[s] > 0).any(1), PIECES))
        rejected.append(np.bincount(piece, (fused.possible[s] > 0).any(1), PIECES))
    count, seen = np.array(share), np.array(rejected)
    width = max(1, math.ceil(PIECES / 100))
    kernel = np.ones(width)
    count, seen = (np.stack([np.convolve(row, kernel, "same") for row in each]) for each in (count, seen))
    with np.errstate(invalid="ignore", divide="ignore"):
        level_used = np.where(seen > 0, count / seen, np.nan)
    figure = go.Figure(
        go.Heatmap(
            x=middle,
            y=names,
            z=level_used,
            zmin=0,
            zmax=1,
            colorscale=[[0, style.VERMILLION], [1, style.BLUE]],
            colorbar={"title": {"text": "used"}, "len": 1, "tickvals": [0, 1], "tickformat": ".0%"},
            hovertemplate="%{x:.6~f} s<br>%{y}: %{z:.0%} used<extra></extra>",
        )
    )
    figure.update_layout(**style.LAYOUT, height=100 + BAR_PX * len(names), meta={"time": True})
    time = {"text": style.TIME, "standoff": 8}
    figure.update_xaxes(**style.axis(title=time, range=[begin + flight.zero_s, end + flight.zero_s]))
    figure.update_yaxes(**style.axis(autorange="reversed"))
    return Drawn(figure, "Share of each station's readings that are used; white: it has none.")


def disagreements(flight: Flight, fused: Fused) -> list[tuple[str, ...]]:
    """Rows of a table: station, from, to, and what happened."""
    clock = Moments.of(flight.trajectory.metadata, flight.trajectory.time_s).clock
    return [
        (each.station, clock(each.first_s + flight.zero_s), clock(each.last_s + flight.zero_s), each.kind)
        for each in findings.stretches(fused)
    ]


FIGURES: dict[str, Any] = {"map": station_map, "residuals": residuals, "biases": biases, "carried": carried}


def drawn(name: str, flight: Flight) -> go.Figure | None:
    """One figure of the page by its name."""
    assert flight.fused is not None
    figure: go.Figure | None = FIGURES[name](flight, flight.fused).figure
    return figure
