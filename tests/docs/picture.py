"""The README's picture: a dirty log of `sample_data` and its cleaned trajectory.

python -m tests.docs.picture [FILE.png]
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure  # without pyplot: no display is needed

import ftproc
from ftproc.core.model.frames import to_cartesian, wrap
from ftproc.records import GOOD, ISOLATED, PATCH, MeasurementLog, Trajectory
from ftproc.report.style import ESTIMATE, KINDS, READING, RESIDUAL_UNIT
from ftproc.settings import FilterSettings

SAMPLES = Path(__file__).parents[2] / "sample_data"
LOG, FILE = SAMPLES / "theodolite.parquet", SAMPLES / "theodolite.png"
MARGIN = 0.15  # of the extent of the cleaned track, that is shown around it
LINEAR = (20.0, 1.0, 1.0)  # m, mrad, mrad: larger residuals are drawn on a logarithmic scale
SYMBOLS = {GOOD: ("good reading", ".", READING)} | {
    code: (KINDS[code].name, symbol, KINDS[code].marker["color"]) for code, symbol in ((ISOLATED, "x"), (PATCH, "D"))
}


def draw(log: MeasurementLog, trajectory: Trajectory) -> Figure:
    """Left: the track over the ground, and what each row of the log shows on its own. Right: the readings minus the
    cleaned ones, over time."""
    figure = Figure(figsize=(10, 5), layout="constrained")
    left, right = figure.subfigures(1, 2)
    _ground(left.subplots(), to_cartesian(log.measurement)[:, :2] / 1e3, trajectory)
    panels = right.subplots(3, 1, sharex=True)
    residual = log.measurement - trajectory.measurement
    residual[:, 1] = wrap(residual[:, 1])
    for component, axes in enumerate(panels):
        _residuals(axes, residual[:, component], trajectory, component)
    panels[-1].set_xlabel("time, s")
    panels[0].set_title("Readings minus cleaned trajectory", fontsize="medium")
    right.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    return figure


def _ground(axes: Any, raw: Any, trajectory: Trajectory) -> None:
    track = trajectory.state[:, :2] / 1e3
    worst = trajectory.outlier.max(axis=1)
    for code, (_, symbol, color) in SYMBOLS.items():
        axes.plot(*raw[worst == code].T, symbol, color=color, markersize=4, mfc="none", zorder=2 + code)
    axes.plot(*track.T, color=ESTIMATE, linewidth=1.5, label="cleaned trajectory", zorder=6)
    low, high = track.min(0), track.max(0)
    around = MARGIN * (high - low).max()
    axes.set(xlim=(low[0] - around, high[0] + around), ylim=(low[1] - around, high[1] + around))
    axes.set(xlabel="x, km", ylabel="y, km", aspect="equal")
    axes.set_title("Track over the ground", fontsize="medium")
    axes.grid(alpha=0.3)
    axes.legend(loc="best", frameon=False)


def _residuals(axes: Any, residual: Any, trajectory: Trajectory, component: int) -> None:
    quantity = RESIDUAL_UNIT[component]
    for code, (name, symbol, color) in SYMBOLS.items():
        shown = trajectory.outlier[:, component] == code
        values = quantity.factor * residual[shown]
        axes.plot(trajectory.time_s[shown], values, symbol, color=color, markersize=3, mfc="none", label=name)
    axes.axhline(0.0, color=ESTIMATE, linewidth=1.5)
    axes.set_yscale("symlog", linthresh=LINEAR[component])
    axes.set_ylabel(quantity.title)
    axes.grid(alpha=0.3)


def save(figure: Figure, target: Path) -> None:
    """As PNG, the same bytes for the same figure."""
    figure.savefig(target, dpi=100, metadata={"Software": None})  # the version of matplotlib is no part of it


def main(target: Path = FILE) -> None:
    """Filter the log and save its picture."""
    log = ftproc.read_log(LOG)
    save(draw(log, ftproc.filter_log(log, FilterSettings(smooth=True))), target)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
