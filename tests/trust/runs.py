"""What becomes of a log with a fault and a truth: wrong or right, what was missed, and the rows of tables of that.

A run is wrong when more than MOST_OFF of its rows have an axis more than OFF published sigmas away from the truth.
Missed are outliers of more than MISSED_SIGMAS that are called good; false alarms, good readings that are not.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ftproc import pipeline
from ftproc.core.model.frames import wrap
from ftproc.errors import FtprocError
from ftproc.quality.verdict import CONSISTENT
from ftproc.records import MISSING, FloatArray, Trajectory
from ftproc.settings import FilterSettings
from ftproc.simulation.contamination import CODES
from ftproc.simulation.simulation import Simulation
from tests.trust import tables

OFF, MOST_OFF = 5.0, 0.01
MISSED_SIGMAS = 8.0
#: What is neither an outlier nor a good reading: after a step the program may follow or correct, copies say nothing.
NEITHER = tuple(CODES[kind] for kind in ("step", "held", "interpolated"))


class Faulty(NamedTuple):
    """A simulated log, and what it is: the flight and the specification of its fault."""

    simulated: Simulation
    what: str


class Detected(NamedTuple):
    """Readings."""

    missed: int = 0
    outliers: int = 0
    false_alarms: int = 0
    good: int = 0


class Run(NamedTuple):
    """What became of a log. copied: readings were named that were not measured; that is a report, too."""

    name: str
    seed: int
    way: str
    what: str
    verdict: str
    reasons: tuple[str, ...] = ()
    copied: bool = False
    wrong: bool = False
    rmse_m: float = np.nan
    detected: Detected = Detected()
    seconds: float = 0.0

    @property
    def confident(self) -> bool:
        return self.wrong and self.verdict == CONSISTENT

    @property
    def reported(self) -> bool:
        return self.copied or self.verdict != CONSISTENT

    def __str__(self) -> str:
        d = self.detected
        return (
            f"{self.name} {self.seed} {self.way}, {self.what}: {self.verdict}, {tables.mark(self)}, "
            f"{self.rmse_m:.4g} m, missed {d.missed} of {d.outliers}, false {d.false_alarms} of {d.good}"
        )


def run(name: str, seed: int, faulty: Faulty) -> list[Run]:
    """A log filtered and smoothed."""
    return [_judged(name, seed, smooth, faulty) for smooth in (False, True)]


def _judged(name: str, seed: int, smooth: bool, faulty: Faulty) -> Run:
    simulated, what = faulty
    way, begun = "smooth" if smooth else "filter", time.process_time()
    try:
        found = pipeline.filter_log(simulated.log, FilterSettings(smooth=smooth))
    except FtprocError as error:
        return Run(name, seed, way, what, f"refused ({error})")
    seconds = time.process_time() - begun
    summary, position_m = found.metadata["summary"], simulated.truth.position_m
    error_m = float(np.sqrt(np.mean(((found.state[:, :3] - position_m) ** 2).sum(1))))
    copied = any(part["held"] + part["interpolated"] for part in summary["components"].values())
    trust, far = summary["trust"], is_far(found, position_m)
    found_out = detected(found, simulated)
    return Run(
        name, seed, way, what, trust["verdict"], tuple(trust["reasons"]), copied, far, error_m, found_out, seconds
    )


def is_far(found: Trajectory, position_m: FloatArray) -> bool:
    """Whether the estimate lies far outside its sigmas. position_m: (n, 3) truth."""
    off = np.abs(found.state[:, :3] - position_m) / found.sigma[:, :3]
    return bool(np.mean((off > OFF).any(1)) > MOST_OFF)


def detected(found: Trajectory, simulated: Simulation) -> Detected:
    """The outliers missed and the false alarms of a run."""
    code = simulated.truth.outlier
    assert code is not None
    off = simulated.log.measurement - simulated.clean
    off[:, 1] = wrap(off[:, 1])
    there, rejected = np.isfinite(off), (found.outlier != 0) & (found.outlier != MISSING)
    large = np.abs(off) > MISSED_SIGMAS * np.array(simulated.sigma)
    bad, good = there & (code > 0) & ~np.isin(code, NEITHER) & large, there & (code == 0)
    return Detected(*(int(each.sum()) for each in (bad & ~rejected, bad, good & rejected, good)))


HEADER = ("class", "runs", "reported", "wrong", "confident and wrong", "missed %", "false alarms %", "seconds")


def of(name: str, found: Iterable[Run]) -> list[Run]:
    """The runs of a class."""
    return [run for run in found if run.name == name]


def row(name: str, found: list[Run]) -> tuple[str, ...]:
    """The row of a class, or of several. Missed and false alarms: the mean of the shares of the runs."""
    missed = [r.detected.missed / r.detected.outliers for r in found if r.detected.outliers]
    false = [r.detected.false_alarms / r.detected.good for r in found if r.detected.good]
    return (
        name,
        str(len(found)),
        str(sum(r.reported for r in found)),
        str(sum(r.wrong for r in found)),
        str(sum(r.confident for r in found)),
        f"{100 * np.mean(missed):.1f}" if missed else "-",
        f"{100 * np.mean(false):.2f}" if false else "-",
        f"{sum(r.seconds for r in found):.0f}",
    )
