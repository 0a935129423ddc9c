"""Whole processes: against reading and writing alone, against loading the libraries, and over the size of the log."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ftproc.files.writing import flights
from ftproc.records import MeasurementLog
from ftproc.simulation import simulate
from tests.bench import measuring
from tests.bench.measuring import Taken
from tests.bench.speed import JERK

HEADER = ("what", "time", "ratio", "to", "bound", "peak memory")
ROUNDS = 3
LARGE = 10**6
DT_S = 0.05
MANY, MANY_ROWS = 64, 20_000
SIZES = [10**3, 10**4, 10**5, LARGE]  # rows; FTPROC_BENCH_ROWS=1e7 adds that many
FLOOR = "read CSV, write 30 Parquet columns"
FORWARD = "`filter --editing forward --noise --jerk`"
WAYS = {FORWARD: ("--editing", "forward"), "`filter`": (), "`filter --smooth`": ("--smooth",)}
BOUNDS = {FORWARD: "<= 3.0", "`filter`": "<= 6", "`filter --smooth`": "<= 6"}
LIBRARIES = "import numpy, pyarrow.parquet"

_FLOOR = """
import sys, numpy as np, pyarrow as pa, pyarrow.csv, pyarrow.parquet
columns = [c.to_numpy() for c in pyarrow.csv.read_csv(sys.argv[1]).columns]
made = {f"c{k}": columns[k % 4] + k for k in range(26)}
n = len(columns[0])
made |= {"row": np.arange(n), **{f"flag{k}": np.zeros(n, np.uint8) for k in range(3)}}
pyarrow.parquet.write_table(pa.table(made), sys.argv[2], compression="snappy", use_dictionary=False)
"""


def rows() -> Iterator[tuple[str, ...]]:
    """Start-up, every size, and the largest against reading and writing alone."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sizes = [*SIZES, *(int(float(n)) for n in os.environ.get("FTPROC_BENCH_ROWS", "").split())]
        sigma = {n: made(folder, n) for n in sizes}
        yield from _startup(folder)
        yield _side_by_side(folder)
        for way in WAYS:
            yield from _over_sizes(folder, way, sizes, sigma)


def made(folder: Path, n: int) -> str:
    """A log of about n rows (some are dropped as gaps); its noise as `--noise` takes it. More than a million are
    flown to and fro."""
    flight = simulate("manoeuvre", seed=1, duration_s=min(n, LARGE) * DT_S, dt_s=DT_S)
    flights.write_log(to_and_fro(flight.log, n // LARGE) if n > LARGE else flight.log, folder / f"{n}.csv")
    return ",".join(f"{s:.6g}" for s in flight.sigma)


def to_and_fro(log: MeasurementLog, times: int) -> MeasurementLog:
    """The flight of a log so many times, every second time backward."""
    since, lasts = log.time_s - log.time_s[0], log.time_s[-1] - log.time_s[0] + DT_S
    time_s = [k * lasts + (since if k % 2 == 0 else since[-1] - since[::-1]) for k in range(times)]
    measurement = [log.measurement[:: 1 if k % 2 == 0 else -1] for k in range(times)]
    return MeasurementLog(log.name, np.concatenate(time_s), np.concatenate(measurement), np.arange(times * len(log)))


def _filter(folder: Path, n: int, way: str, sigma: str) -> list[str]:
    given = ["--noise", sigma, "--jerk", str(JERK)] if way == FORWARD else []
    program = [sys.executable, "-c", "from ftproc.cli.main import main; main()", "filter", str(folder / f"{n}.csv")]
    return [*program, "-o", str(folder / "out.parquet"), "--summary", "none", *WAYS[way], *given]


def _startup(folder: Path) -> Iterator[tuple[str, ...]]:
    program = [sys.executable, "-c", "from ftproc.cli.main import main; main()"]
    for name, command, reference, bound in (("`ftproc --help`", [*program, "--help"], "import click", "<= 1.5"),):
        taken = measuring.processes({name: command, reference: [sys.executable, "-c", reference]}, 3 * ROUNDS)
        yield _row(name, taken[name], taken[reference], f"`python -c '{reference}'`", bound)


def _side_by_side(folder: Path) -> tuple[str, ...]:
    """Many logs in two processes against one."""
    logs_of = folder / "many"
    logs_of.mkdir()
    first = logs_of / "0.csv"
    flights.write_log(simulate("manoeuvre", seed=1, duration_s=MANY_ROWS * DT_S, dt_s=DT_S).log, first)
    for k in range(1, MANY):
        (logs_of / f"{k}.csv").hardlink_to(first)
    program = [sys.executable, "-c", "from ftproc.cli.main import main; main()", "filter", *map(str, logs_of.iterdir())]
    program += ["-o", str(folder / "out"), "--summary", "none", "--redo", "--jobs"]
    taken = measuring.processes({jobs: [*program, jobs] for jobs in ("1", "2")}, 0)
    return _row(f"{MANY} logs of {MANY_ROWS:,} rows, `--jobs 2`", taken["2"], taken["1"], "`--jobs 1`", "<= 0.6")


def _over_sizes(folder: Path, way: str, sizes: list[int], sigma: dict[int, str]) -> Iterator[tuple[str, ...]]:
    """What is larger than a million rows is done once."""
    per_row = 0.0
    for n in sizes:
        floor = [sys.executable, "-c", _FLOOR, str(folder / f"{n}.csv"), str(folder / "out.parquet")]
        commands = {FLOOR: floor, way: _filter(folder, n, way, sigma[n])}
        taken = measuring.processes(commands, ROUNDS if n <= LARGE else 0)
        yield _row(f"{n:.0e} rows, {way}", taken[way], taken[FLOOR], FLOOR, BOUNDS[way] if n == LARGE else "")
        cost = taken[way].seconds / n
        per_row = cost if n == 10**5 else per_row
        if n > LARGE:
            yield (
                f"{n:.0e} rows, {way}",
                f"{1e6 * cost:.3g} us",
                f"{cost / per_row:.2f}",
                "1e5 rows, per row",
                "<= 1.15",
                "",
            )


def _row(name: str, each: Taken, reference: Taken, to: str, bound: str) -> tuple[str, ...]:
    return name, f"{each.seconds:.3g} s", f"{each.seconds / reference.seconds:.2f}", to, bound, _mb(each)


def _mb(taken: Taken) -> str:
    return f"{taken.peak_mb:.0f} MB"
