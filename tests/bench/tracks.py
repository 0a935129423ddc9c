"""`python -m tests.bench.tracks FOLDER`: tracks of real instruments, FOLDER/NAME/log.csv, against an independent truth,
FOLDER/NAME/truth.parquet (time_s, x_m, y_m, z_m near the station's axes). Median position errors of the readings and of
the smoother, once a constant offset of each component and of the clock is fitted; how much of the truth lies inside 3
sigma; how many readings are called outliers; and the verdict. A component that is the same throughout was not measured,
and is left out of the errors."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.optimize import least_squares

from ftproc import api
from ftproc.core.model.frames import from_cartesian, to_cartesian, wrap
from ftproc.records import FloatArray
from ftproc.settings import FilterSettings
from tests.bench.__main__ import markdown

HEADER = ("track", "rows", "raw, m", "smoothed, m", "inside 3 sigma", "called outliers", "verdict")
LONGEST_HOLE_S = 2.0  # of the truth, over which it is interpolated
LATEST_S = 2.5  # that a clock may be off


def rows(folder: Path) -> Iterator[tuple[str, ...]]:
    """One row for each track with a truth."""
    for truth in sorted(folder.glob("*/truth.parquet")):
        log = api.read_log(truth.parent / "log.csv")
        trajectory = api.filter_log(log, FilterSettings(smooth=True))
        true, known = _at(truth, log.time_s, log.measurement)
        axes = 2 if np.ptp(log.measurement[:, 2]) == 0 else 3
        raw = (to_cartesian(log.measurement) - true)[known, :axes]
        away = (trajectory.state[:, :3] - true)[known, :axes]
        inside = np.abs(away) <= 3 * trajectory.sigma[known, :axes]
        yield (
            truth.parent.name, str(len(log)),
            *(f"{np.median(np.linalg.norm(each, axis=1)):.3g}" for each in (raw, away)),
            f"{100 * inside.mean():.1f} %", f"{100 * np.isin(trajectory.outlier[:, :axes], (1, 2)).mean():.1f} %",
            trajectory.metadata["summary"]["trust"]["verdict"],
        )  # fmt: skip


def _at(path: Path, time_s: FloatArray, measurement: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The truth (n, 3) m at the times of the readings, moved to them by constant offsets, and where it is known."""
    import pyarrow.parquet as pq

    columns = pq.read_table(path, columns=["time_s", "x_m", "y_m", "z_m"])
    table = np.column_stack([column.to_numpy() for column in columns.columns])
    times, first = np.unique(table[:, 0], return_index=True)
    path_of = make_interp_spline(times, table[first, 1:], k=3)
    after = np.clip(np.searchsorted(times, time_s), 1, len(times) - 1)
    known = times[after] - times[after - 1] <= max(LONGEST_HOLE_S, 2 * float(np.median(np.diff(times))))
    known &= (time_s >= times[0]) & (time_s <= times[-1]) & np.isfinite(measurement).all(1)

    def off(late_s: float) -> FloatArray:
        found = measurement - from_cartesian(path_of(time_s + late_s))
        found[:, 1] = wrap(found[:, 1])
        return found

    middle = np.median(off(0.0)[known], 0)
    scale = np.maximum(1.4826 * np.median(np.abs(off(0.0)[known] - middle), 0), 1e-12)

    def residual(offsets: FloatArray) -> FloatArray:
        found: FloatArray = ((off(offsets[3]) / scale) - offsets[:3])[known].ravel()
        return found

    bounds = np.array([np.inf, np.inf, np.inf, LATEST_S])
    fitted = least_squares(residual, np.append(middle / scale, 0.0), loss="soft_l1", bounds=(-bounds, bounds)).x
    return to_cartesian(from_cartesian(path_of(time_s + fitted[3])) + fitted[:3] * scale), known


if __name__ == "__main__":
    if len(sys.argv) != 2 or not Path(sys.argv[1]).is_dir():
        sys.exit("Name one folder of tracks: python -m tests.bench.tracks FOLDER")
    for line in markdown(HEADER, rows(Path(sys.argv[1]))):
        print(line, flush=True)
