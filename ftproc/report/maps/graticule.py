"""Lines of equal latitude and longitude on the map, where the site is known: a chart without a network."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ftproc.derived.quantities import site_of
from ftproc.errors import UsageError
from ftproc.files.writing import geodesy
from ftproc.records import FloatArray
from ftproc.report import style
from ftproc.report.view import View

if TYPE_CHECKING:
    import plotly.graph_objects as go

STEPS_DEG = [s / 3600 for s in (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 18_000, 36_000)]
MOST_LINES = 5
POINTS = 40  # of a line, which is curved
WIDER = 0.5  # share of the extent around it that is drawn too: the axes may be stretched


def add(figure: go.Figure, view: View, extent: tuple[FloatArray, FloatArray]) -> None:
    """Draw the lines below everything else. extent: the least and the greatest (2,) east and north on the map, m."""
    site = site_of(view.trajectory.metadata)
    if site is None:
        return
    try:
        earth = geodesy.require_pymap3d()
    except UsageError:
        return
    low, high = extent
    room = WIDER * float((high - low).max())
    east, north = np.meshgrid(np.linspace(low[0], high[0], 3), np.linspace(low[1], high[1], 3))
    latitude, longitude, _ = earth.enu2geodetic(east, north, np.zeros_like(east), *site)
    wider = room / 111_000
    for degrees, other, is_latitude in ((latitude, longitude, True), (longitude, latitude, False)):
        step = next((each for each in STEPS_DEG if np.ptp(degrees) / each <= MOST_LINES), STEPS_DEG[-1])
        values = np.arange(np.ceil(degrees.min() / step), np.floor(degrees.max() / step) + 1) * step
        along = np.linspace(other.min() - wider, other.max() + wider, POINTS)
        for value in values:
            fixed = np.full(POINTS, value)
            pair = (fixed, along) if is_latitude else (along, fixed)
            x, y, _ = earth.geodetic2enu(*pair, np.full(POINTS, site[2]), *site)
            _line(figure, np.asarray(x), np.asarray(y), said(float(value), is_latitude, step), is_latitude, extent)


def _line(
    figure: go.Figure, x: FloatArray, y: FloatArray, name: str, is_latitude: bool, extent: tuple[FloatArray, FloatArray]
) -> None:
    """A thin line with its name at the edge of the map."""
    figure.add_scatter(
        x=x.astype(np.float32), y=y.astype(np.float32), mode="lines", showlegend=False, hoverinfo="skip",
        line={"color": style.SKY, "width": 0.7, "dash": "dot"},
    )  # fmt: skip
    low, _ = extent
    edge = (low[0], float(np.interp(low[0], x, y))) if is_latitude else (float(np.interp(low[1], y, x)), low[1])
    figure.add_annotation(
        x=edge[0], y=edge[1], text=name, showarrow=False, font={"size": 10, "color": style.GREY},
        xanchor="left", yanchor="bottom",
    )  # fmt: skip


def said(degrees: float, is_latitude: bool, step: float) -> str:
    """Such as 48°05'N, with seconds where the step has some."""
    seconds = round(abs(degrees) * 3600)
    whole, rest = divmod(seconds, 3600)
    minutes, seconds = divmod(rest, 60)
    text = f"{whole}°" + (f"{minutes:02d}'" if step < 1 else "") + (f'{seconds:02d}"' if step < 1 / 60 else "")
    return text + ("NS" if is_latitude else "EW")[degrees < 0]
