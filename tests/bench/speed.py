"""Speed as ratios within one run: to filterpy's UKF, and of whole processes to loading the libraries they need."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from ftproc import pipeline
from ftproc.core import forward, motion
from ftproc.core.smoother import smooth_log
from ftproc.files import logs
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate

HEADER = ("what", "time", "ratio", "to")


def rows() -> Iterator[tuple[str, ...]]:
    """Kernels per sample, then whole processes."""
    flight = simulate("manoeuvre", seed=1, duration_s=500.0)
    log, n = flight.log, len(flight.log)
    readings = log.time_s - log.time_s[0], log.measurement, np.isfinite(log.measurement).astype(float)
    assert flight.truth.velocity_mps is not None
    state = np.r_[flight.truth.position_m[0], flight.truth.velocity_mps[0], np.zeros(3)]
    start = forward.Start(0, state, np.diag([25.0] * 3 + [4.0] * 3 + [25.0] * 3))
    model = forward.Model(np.array(flight.sigma) ** 2, motion.isotropic(10.0))
    peer = _best(lambda: _filterpy(readings[0][:400], readings[1][:400], model, start), 2) / 400
    yield "filterpy UKF, per sample", f"{1e6 * peer:.0f} us", "1", "itself"
    for name, call in (
        ("UKF forward pass", lambda: forward.filter_log(*readings, model, [start])),
        ("forward pass and smoother", lambda: smooth_log(*readings, model, [start])),
        ("filter, --editing forward", lambda: pipeline.filter_log(log, FilterSettings(editing="forward"))),
        ("filter, the default", lambda: pipeline.filter_log(log)),
        ("filter, --smooth", lambda: pipeline.filter_log(log, FilterSettings(smooth=True))),
    ):
        each = _best(call, 3) / n
        yield f"{name}, per sample", f"{1e6 * each:.2f} us", f"{peer / each:.0f} x faster", "filterpy UKF"
    yield from _processes(log)


def _processes(log: object) -> Iterator[tuple[str, ...]]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        logs.write(log, path)  # type: ignore[arg-type]
        ftproc = [sys.executable, "-c", "from ftproc.cli.main import main; main()"]
        run = [*ftproc, "filter", str(path), "-o", str(Path(folder) / "out.parquet"), "--summary", "none"]
        for name, command, reference in (
            ("`ftproc filter`, 10,000 rows, process", run, "import numpy, numba, pyarrow.parquet"),
            ("the same, --editing forward", [*run, "--editing", "forward"], "import numpy, numba, pyarrow.parquet"),
            ("`ftproc --help`, process", [*ftproc, "--help"], "import click"),
        ):
            ours, theirs = _paired(command, [sys.executable, "-c", reference])
            yield name, f"{ours:.2f} s", f"{ours / theirs:.2f}", f"`python -c '{reference}'`"


def _best(call: Callable[[], object], times: int) -> float:
    call()
    taken = []
    for _ in range(times):
        began = time.perf_counter()
        call()
        taken.append(time.perf_counter() - began)
    return min(taken)


def _paired(ours: Sequence[str], theirs: Sequence[str]) -> tuple[float, float]:
    """Median seconds of two commands run in turn."""
    taken: tuple[list[float], list[float]] = ([], [])
    for _ in range(6):
        for command, found in zip((ours, theirs), taken, strict=True):
            began = time.perf_counter()
            subprocess.run(command, check=True, capture_output=True)
            found.append(time.perf_counter() - began)
    return float(np.median(taken[0][1:])), float(np.median(taken[1][1:]))


def _filterpy(time_s: np.ndarray, z: np.ndarray, model: forward.Model, start: forward.Start) -> None:
    """The same filter as filterpy's users would write it."""
    from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

    def move(x: np.ndarray, dt: float) -> np.ndarray:
        return np.r_[x[:3] + dt * x[3:6] + dt * dt / 2 * x[6:], x[3:6] + dt * x[6:], x[6:]]

    def measure(x: np.ndarray) -> np.ndarray:
        ground = np.hypot(x[0], x[1])
        return np.array([np.hypot(ground, x[2]), np.arctan2(x[1], x[0]), np.arctan2(x[2], ground)])

    points = MerweScaledSigmaPoints(9, alpha=1.0, beta=0.0, kappa=0.0)
    ukf = UnscentedKalmanFilter(9, 3, 0.05, measure, move, points)
    ukf.x, ukf.P, ukf.R = start.state.copy(), start.covariance.copy(), np.diag(model.noise_variance)
    for k in range(len(time_s)):
        if k:
            ukf.predict(dt=time_s[k] - time_s[k - 1])
        if np.isfinite(z[k]).all():
            ukf.update(z[k])
