"""Live editing: what one reading costs when it comes alone, and the memory of following a log that does not end."""

from __future__ import annotations

import os
import shlex
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import ftproc
from ftproc.files.writing import flights
from ftproc.records import MeasurementLog
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate
from tests.bench import measuring, scale

HEADER = ("what", "per reading", "99th percentile", "of the interval", "peak memory", "bound")
OUTLIERS = "isolated=0.04:6-300,offset=3:20-80:8-100,ramp=2:20-80:8-100"
RATES = {1.0: 3600.0, 20.0: 300.0, 1000.0: 30.0}  # Hz: seconds of flight
LAG_S = 2.0
ROWS = (10**4, 10**5)  # followed; FTPROC_BENCH_ROWS=1e6 adds that many
BOUND_MB = 1.1  # times the peak memory of the log before


def rows() -> Iterator[tuple[str, ...]]:
    """One reading after the other at three rates, then logs of growing length through `--follow`."""
    for rate, lasts in RATES.items():
        yield _one_by_one(rate, lasts)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        yield from _followed(folder)


def _one_by_one(rate: float, lasts: float) -> tuple[str, ...]:
    log = simulate("manoeuvre", seed=5, duration_s=lasts, dt_s=1 / rate, outliers=OUTLIERS).log
    track = ftproc.Live(FilterSettings(editing="live", lag_s=LAG_S))
    taken = []
    for moment, reading in zip(log.time_s, log.measurement, strict=True):
        began = time.perf_counter()
        track.push(moment, *reading)
        taken.append(time.perf_counter() - began)
    mean, tail = float(np.mean(taken)), float(np.quantile(taken, 0.99))
    bound = "<= 4 ms, 25 ms" if rate == 20 else "<= 100 %" if rate > 20 else ""
    return f"{rate:g} Hz", _ms(mean), _ms(tail), f"{100 * mean * rate:.2g} %", "", bound


def _followed(folder: Path) -> Iterator[tuple[str, ...]]:
    before = 0.0
    for n in (*ROWS, *(int(float(n)) for n in os.environ.get("FTPROC_BENCH_ROWS", "").split())):
        log = folder / f"{n}.csv"
        flights.write_log(_long(n), log)
        program = [sys.executable, "-m", "ftproc", "filter", "-", "--follow", "--lag", f"{LAG_S:g}"]
        command = f"exec {shlex.join([*program, '-o', str(folder / 'out.csv')])} < {shlex.quote(str(log))}"
        taken = measuring.processes({"follow": ["/bin/sh", "-c", command]}, 0)["follow"]
        with (folder / "out.csv").open("rb") as made:
            assert sum(1 for _ in made) > n * 0.9, "rows are missing"
        ratio = f"{taken.peak_mb / before:.2f} x" if before else ""
        before = taken.peak_mb
        bound = f"<= {BOUND_MB} x" if ratio else ""
        yield (
            f"`--follow`, {n:.0e} rows at 20 Hz", _ms(taken.seconds / n), "", "",
            f"{taken.peak_mb:.0f} MB {ratio}".strip(), bound,
        )  # fmt: skip


def _long(n: int) -> MeasurementLog:
    """A log of about n rows, flown to and fro over a hundredth of the largest of the other tables."""
    piece = scale.LARGE // 100
    flight = simulate("manoeuvre", seed=1, duration_s=piece * scale.DT_S, dt_s=scale.DT_S)
    return scale.to_and_fro(flight.log, max(n // piece, 1))


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms"
