"""NIS, sigmas, motion, network correction and errors over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ftproc.quality import consistency
from ftproc.records import FloatArray
from ftproc.report import drawing, style
from ftproc.report.drawing import DASHES, Drawn
from ftproc.report.patches import steps
from ftproc.report.style import require_plotly
from ftproc.report.view import View, load_factor, speed

if TYPE_CHECKING:
    import plotly.graph_objects as go

INTERVALS, LEAST_IN_INTERVAL = 60, 25  # number of means of NIS, and least samples in each
TICKS = [m * 10.0**k for k in range(-6, 9) for m in (1, 3)]  # of logarithmic axes
WITHIN = 3  # published sigmas, the limits drawn with the errors


def nis(view: View) -> Drawn:
    """NIS of each sample, and its means over intervals with their 99 % bounds."""
    value = view.trajectory.nis
    count = int(np.isfinite(value).sum())
    if not count:
        return Drawn(None, "No normalised innovation squared is known.")
    figure = drawing.rows(view.timeline, ["NIS"], 340)
    number = max(1, min(INTERVALS, count // LEAST_IN_INTERVAL))
    middle, total, samples = view.timeline.means(value, number)
    _, freedom, _ = view.timeline.means(np.where(np.isfinite(value), view.components_used, np.nan), number)
    samples = np.where(samples > 0, samples, np.nan)
    low, high = consistency.nis_bounds(freedom)
    plotly = require_plotly()
    if not view.timeline.thinned:
        drawing.add(figure, drawing.dots(view.timeline, value, "sample", style.READING))
    lines = [("mean over an interval", total, style.BLUE, "solid"), ("expected", freedom, style.BLACK, "solid"),
           ("bounds", low, style.VERMILLION, "dash"), ("bounds", high, style.VERMILLION, "dash")]  # fmt: skip
    for index, (name, sums, colour, dash) in enumerate(lines):
        path = {"color": colour, "dash": dash, "width": 1.5 if index else 2, "shape": "hvh"}
        mode = "lines+markers" if number == 1 or not index else "lines"
        trace = plotly.Scatter(x=middle, y=sums / samples, name=name, mode=mode, line=path, marker={"size": 5})
        drawing.add(figure, trace, first=index < 3)
    top = 1.3 * float(np.nanmax(np.maximum(high, total) / samples))
    if not view.timeline.thinned:
        top = max(top, float(np.nanquantile(value, 0.995)))
    figure.update_yaxes(range=[0, top])
    _add_steps(figure, view)
    note = (
        "Above the bounds the sigmas are too small, below too large. 99 of 100 means of a consistent filter lie "
        "between them; they are at least 20 % of a sigma wide."
    )
    return Drawn(figure, note)


def sigmas(view: View) -> Drawn:
    """1-sigma of position and velocity."""
    sigma = view.trajectory.sigma
    if not np.isfinite(sigma).any():
        return Drawn(None, "The trajectory has no sigmas: its position is not observable.")
    figure = drawing.rows(view.timeline, ["σ position, m", "σ velocity, m/s"], 440)
    _triples(figure, view, sigma)
    figure.update_yaxes(type="log", tickvals=TICKS, ticktext=[f"{tick:g}" for tick in TICKS])
    _add_steps(figure, view, 2)
    return Drawn(figure, "1 sigma of the estimate, along the axes.")


def motion(view: View) -> Drawn:
    """Speed, height and load factor."""
    state = view.trajectory.state
    if not view.has_position:
        return Drawn(None, "Position and velocity are not observable.")
    parts = [
        ("speed, m/s", speed(state)),
        ("height, m", state[:, 2]),
        ("load factor, g", load_factor(state)),
    ]
    known = [(title, value) for title, value in parts if np.isfinite(value).any()]
    figure = drawing.rows(view.timeline, [title for title, _ in known], 200 * len(known) + 60)
    for row, (title, value) in enumerate(known):
        drawing.add(figure, drawing.line(view.timeline, value, title.split(",")[0], style.BLUE), row)
    figure.update_layout(showlegend=False, margin_t=14)
    _add_steps(figure, view, len(known))
    note = "Height over the station."
    if len(known) == len(parts):
        note += " Load factor: specific force across the direction of flight, z being the vertical."
    return Drawn(figure, note)


def correction(view: View) -> Drawn:
    """The network's correction of position and velocity."""
    added = view.trajectory.correction
    if not np.isfinite(added).any():
        return Drawn(None, "The file has no network correction.")
    if not np.nan_to_num(added).any():
        return Drawn(None, "No network correction: this is the plain filter or smoother.")
    figure = drawing.rows(view.timeline, ["position, m", "velocity, m/s"], 440)
    _triples(figure, view, added)
    _add_steps(figure, view, 2)
    return Drawn(figure, "The estimate minus the correction is the plain filter.")


def errors(view: View) -> Drawn:
    """Errors against the truth, and 3 published sigmas each way."""
    if view.error is None:
        return Drawn(None, "There is no truth to compare with.")
    if not np.isfinite(view.error).any():
        return Drawn(None, "The truth's times do not overlap those of the trajectory.")
    velocity = bool(np.isfinite(view.error[:, 3:]).any())
    columns = 2 if velocity else 1
    names = [style.POSITION, style.VELOCITY][:columns]
    figure = drawing.rows(
        view.timeline, [f"error in {pair[axis].title}" for axis in range(3) for pair in names], 640, columns
    )
    bound = WITHIN * view.trajectory.sigma
    for column in range(columns):
        for axis in range(3):
            k, first = 3 * column + axis, not (column or axis)
            drawing.add(figure, drawing.line(view.timeline, view.error[:, k], "error", style.BLUE), axis, column, first)
            for sign in (-1, 1):
                limit = drawing.line(view.timeline, sign * bound[:, k], f"{WITHIN} sigmas", style.BLACK, "dash", 1)
                drawing.add(figure, limit, axis, column, first and sign < 0)
    _add_steps(figure, view, 3, columns)
    return Drawn(figure, "")


def _add_steps(figure: go.Figure, view: View, rows: int = 1, columns: int = 1) -> None:
    """Lines at the steps through all plots, with labels in the uppermost."""
    for row in range(rows):
        for column in range(columns):
            drawing.step_lines(figure, steps(view), row, column, labelled=not row)


def _triples(figure: go.Figure, view: View, value: FloatArray) -> None:
    """(n, 6): x, y, z of position in the first row, of velocity in the second."""
    for row in range(2):
        for axis, name in enumerate("xyz"):
            one = value[:, 3 * row + axis]
            if np.isfinite(one).any():
                trace = drawing.line(view.timeline, one, name, style.AXES[axis], DASHES[axis])
                drawing.add(figure, trace, row, first=row == 0)
