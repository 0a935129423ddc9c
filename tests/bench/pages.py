"""The report of a long log: its size, how long it takes to be written, and to open in Chromium with all drawn."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from ftproc import pipeline, report
from ftproc.records import Trajectory
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate
from tests.report.browser import CHROMIUM, Opened, browser

HEADER = ("report of", "flagged readings", "size (< 8 MB)", "written in (< 5 s)", "opened in (< 5 s)")
DT_S = 0.05
SIZES = (10**4, 10**6)  # rows
ROUNDS = 3  # the best of which counts: what else the machine does is not the page's


def rows() -> Iterator[tuple[str, ...]]:
    """A dirty log of each size. Its filter is the fastest, for the page does not depend on it."""
    for n in SIZES:
        flight = simulate("manoeuvre", seed=1, duration_s=n * DT_S, dt_s=DT_S)
        settings = FilterSettings(editing="forward", noise=tuple(flight.sigma), jerk_psd_m2ps5=10.0)
        trajectory = pipeline.filter_log(flight.log, settings)
        flagged = int((trajectory.outlier > 0).sum())
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "page.html")
            written = min(_written(trajectory, file) for _ in range(ROUNDS))
            opened = f"{_opened(file, Path(folder)):.2f} s" if CHROMIUM else "Chromium is not installed"
            size = f"{file.stat().st_size / 1e6:.1f} MB"
        yield f"{n:,} rows", f"{flagged:,}", size, f"{written:.2f} s", opened


def _written(trajectory: Trajectory, file: Path) -> float:
    began = time.perf_counter()
    report.write(trajectory, file)
    return time.perf_counter() - began


def _opened(file: Path, folder: Path) -> float:
    """From the address to the last figure, s."""
    taken = []
    with browser(folder / "profile") as context:
        for _ in range(ROUNDS):
            began = time.perf_counter()
            opened = Opened(context, file)
            taken.append(time.perf_counter() - began)
            opened.page.close()
    return min(taken)
