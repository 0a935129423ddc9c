"""NIS, sigmas, motion, network correction and errors over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ftproc.derived.quantities import QUANTITIES, Derived
from ftproc.quality import consistency
from ftproc.records import COMPONENTS, FloatArray
from ftproc.report import drawing, style
from ftproc.report.drawing import DASHES, Drawn
from ftproc.report.patches import steps
from ftproc.report.style import require_plotly
from ftproc.report.view import View, speed

if TYPE_CHECKING:
    import plotly.graph_objects as go

INTERVALS, LEAST_IN_INTERVAL = 60, 25  # number of means of NIS, and least samples in each
TICKS = [m * 10.0**k for k in range(-6, 9) for m in (1, 3)]  # of logarithmic axes
WITHIN = 3  # published sigmas, the limits drawn with the errors
_SHOWN = ("climb_rate_mps", "turn_rate_degps", "load_factor")  # of `derived`
_STATE = ("position, m", "velocity, m/s", "acceleration, m/s²")


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
    """1-sigma of position, velocity and acceleration; of the cleaned readings where there is no position."""
    sigma = view.trajectory.sigma
    if not np.isfinite(sigma).any():
        return _sigmas_of_readings(view)
    shown = [k for k in range(len(_STATE)) if np.isfinite(sigma[:, 3 * k : 3 * k + 3]).any()]
    figure = drawing.rows(view.timeline, [f"σ {_STATE[k]}" for k in shown], 220 * len(shown))
    _triples(figure, view, np.hstack([sigma[:, 3 * k : 3 * k + 3] for k in shown]))
    return _on_log_scale(figure, view, len(shown), "1 sigma of the estimate, along the axes.")


def _sigmas_of_readings(view: View) -> Drawn:
    sigma = view.trajectory.measurement_sigma * [quantity.factor for quantity in style.RESIDUAL_UNIT]
    shown = [c for c in range(3) if np.isfinite(sigma[:, c]).any()]
    if not shown:
        return Drawn(None, "The trajectory has no sigmas.")
    titles = [f"σ {style.RESIDUAL_UNIT[c].title}" for c in shown]
    figure = drawing.rows(view.timeline, titles, 220 * len(shown))
    for row, c in enumerate(shown):
        drawing.add(figure, drawing.line(view.timeline, sigma[:, c], COMPONENTS[c], style.BLUE), row)
    return _on_log_scale(figure, view, len(shown), "1 sigma of the cleaned readings; the position is not observable.")


def _on_log_scale(figure: go.Figure, view: View, rows: int, note: str) -> Drawn:
    figure.update_yaxes(type="log", tickvals=TICKS, ticktext=[f"{tick:g}" for tick in TICKS])
    _add_steps(figure, view, rows)
    return Drawn(figure, note)


def motion(view: View) -> Drawn:
    """Speed, height, climb rate, turn rate and load factor."""
    state = view.trajectory.state
    if not view.has_position:
        return Drawn(None, "Position and velocity are not observable.")
    value = Derived.of(view.trajectory).value
    parts = [
        ("speed, m/s", speed(state)),
        ("height, m", state[:, 2]),
        *((f"{q.label}, {q.unit}", value[:, k]) for k, q in enumerate(QUANTITIES) if q.name in _SHOWN),
    ]
    known = [(title, value) for title, value in parts if np.isfinite(value).any()]
    figure = drawing.rows(view.timeline, [title for title, _ in known], 200 * len(known) + 60)
    for row, (title, value) in enumerate(known):
        drawing.add(figure, drawing.line(view.timeline, value, title.split(",")[0], style.BLUE), row)
    figure.update_layout(showlegend=False, margin_t=14)
    _add_steps(figure, view, len(known))
    note = f"Height over the {'origin' if view.trajectory.metadata.get('stations') else 'station'}."
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
    if view.error is None or view.cleaned_error is None:
        return Drawn(None, "There is no truth to compare with.")
    if not np.isfinite(view.error).any():
        return _errors_of_readings(view, view.cleaned_error)
    columns = max(k + 1 for k in range(3) if k == 0 or np.isfinite(view.error[:, 3 * k : 3 * k + 3]).any())
    names = [style.POSITION, style.VELOCITY, style.ACCELERATION][:columns]
    figure = drawing.rows(
        view.timeline, [f"error in {pair[axis].title}" for axis in range(3) for pair in names], 640, columns
    )
    for k in range(3 * columns):
        _add_error(figure, view, view.error[:, k], view.trajectory.sigma[:, k], (k % 3, k // 3))
    _add_steps(figure, view, 3, columns)
    return Drawn(figure, "")


def _errors_of_readings(view: View, error: FloatArray) -> Drawn:
    """Of the cleaned readings, where there is no position."""
    shown = [c for c in range(3) if np.isfinite(error[:, c]).any()]
    if not shown:
        return Drawn(None, "The truth's times do not overlap those of the trajectory.")
    figure = drawing.rows(view.timeline, [f"error in {style.RESIDUAL_UNIT[c].title}" for c in shown], 220 * len(shown))
    for row, c in enumerate(shown):
        factor = style.RESIDUAL_UNIT[c].factor
        _add_error(figure, view, factor * error[:, c], factor * view.trajectory.measurement_sigma[:, c], (row, 0))
    _add_steps(figure, view, len(shown))
    return Drawn(figure, "Errors of the cleaned readings; the position is not observable.")


def _add_error(figure: go.Figure, view: View, error: FloatArray, sigma: FloatArray, cell: tuple[int, int]) -> None:
    """An error (n,) and its sigmas (n,) in a row and column."""
    drawing.add(figure, drawing.line(view.timeline, error, "error", style.BLUE), *cell, cell == (0, 0))
    for sign in (-1, 1):
        limit = drawing.line(view.timeline, sign * WITHIN * sigma, f"{WITHIN} sigmas", style.BLACK, "dash", 1)
        drawing.add(figure, limit, *cell, cell == (0, 0) and sign < 0)


def _add_steps(figure: go.Figure, view: View, rows: int = 1, columns: int = 1) -> None:
    """Lines at the steps through all plots, with labels in the uppermost."""
    for row in range(rows):
        for column in range(columns):
            drawing.step_lines(figure, steps(view), row, column, labelled=not row)


def _triples(figure: go.Figure, view: View, value: FloatArray) -> None:
    """(n, 3 rows): x, y, z of a quantity in each row."""
    for row in range(value.shape[1] // 3):
        for axis, name in enumerate("xyz"):
            one = value[:, 3 * row + axis]
            if np.isfinite(one).any():
                trace = drawing.line(view.timeline, one, name, style.AXES[axis], DASHES[axis])
                drawing.add(figure, trace, row, first=row == 0)
