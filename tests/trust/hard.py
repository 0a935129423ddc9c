"""The table of hard faults on hard flights: classes of faults by the flights of `hard_flights`, filter and smoother.

    python -m tests.trust.hard 0-4 offset exchange     seeds 0 to 4 of two classes; all of them where none is named
    python -m tests.trust.hard 0-4 -v -j 2             a line for each run, by two processes

A run is wrong when more than 1 % of its rows have an axis more than 5 published sigmas away from the truth. Missed are
outliers of more than 8 sigmas that are called good; false alarms, good readings that are not.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ftproc import pipeline
from ftproc.core.model.frames import wrap
from ftproc.errors import FtprocError
from ftproc.quality.verdict import CONSISTENT
from ftproc.records import MISSING, Trajectory
from ftproc.settings import FilterSettings
from ftproc.simulation.contamination import CODES
from ftproc.simulation.instrument import PERFECT
from ftproc.simulation.scenarios import Plan
from ftproc.simulation.simulation import Simulation, measure
from tests.trust import hard_flights, tables
from tests.trust.hard_flights import Seen
from tests.trust.verdicts import is_far

MISSED_SIGMAS = 8.0
ENDS = "start", "end"


def _lasts(seen: Seen, low_s: float, high_s: float) -> str:
    """Seconds as LENGTH in a specification: at least four samples, at most a third of the log."""
    most = min(high_s, seen.lasts_s / 3)
    return f"{min(max(low_s, 4 * seen.dt_s), most):.6g}-{most:.6g}s"


def _jump(seen: Seen) -> str:
    """Seconds by which a clock jumps: at least two samples, at most a tenth of the log."""
    low, high = min(max(0.2, 2 * seen.dt_s), 0.05 * seen.lasts_s), min(max(2.0, 3 * seen.dt_s), 0.1 * seen.lasts_s)
    return f"{low:.6g}-{high:.6g}"


def _patch(kind: str) -> Callable[[Seen, int], str]:
    size = "" if kind in ("stuck", "mirror") else ":8-200"
    return lambda seen, seed: f"one.{kind}=1:{_lasts(seen, 2, 60)}{size}"


#: Class -> the specification of its fault, for a flight and a seed. The sizes of patches are those that show.
PATCHES = {kind: _patch(kind) for kind in ("offset", "ramp", "walkoff", "sine", "stuck", "mirror", "sidelobe")}
COMBINED: dict[str, Callable[[Seen, int], str]] = {
    "three": lambda seen, seed: f"one.mixed=3:{_lasts(seen, 2, 20)}:8-200",
    "two": lambda seen, seed: f"two.mixed=1:{_lasts(seen, 2, 60)}:8-200",
    "ends": lambda seen, seed: f"one.mixed=1:{_lasts(seen, 2, 30)}@{ENDS[seed % 2]}:8-200",
    "exchange": lambda seen, seed: f"all.other=1:{_lasts(seen, 20, 20)}:30-300",
    "blocks": lambda seen, seed: f"all.{('replay', 'swap')[seed % 2]}=1:{_lasts(seen, 2, 20)}",
    "missing": lambda seen, seed: f"{('', 'all.')[seed % 2]}nan=0.5,one.mixed=2:{_lasts(seen, 2, 20)}:8-200",
}
CHANGES: dict[str, Callable[[Seen, int], str]] = {
    "step": lambda seen, seed: "one.step=1:10-100",
    "clock": lambda seen, seed: f"{('late', 'clock')[seed % 2]}=1:{_jump(seen)}",
    "noise": lambda seen, seed: "noise=1:33%:10",
    "noiseless": lambda seen, seed: "one.noise=1:100%:0",
    "ar1": lambda seen, seed: f"correlation={seen.dt_s * (2, 4, 8)[seed % 3]:.6g}",
}
DIRT: dict[str, Callable[[Seen, int], str]] = {
    "isolated": lambda seen, seed: f"isolated={(0.01, 0.1, 0.2, 0.4)[seed % 4]}:6-300",
    "second": lambda seen, seed: "isolated=0.5:6-10",
}
SOUND: dict[str, Callable[[Seen, int], str]] = {
    "clean": lambda seen, seed: "none" if seed % 2 else "jitter=0.2",
    "abrupt": lambda seen, seed: "none",
}
GROUPS = {"patches": PATCHES, "combined": COMBINED, "changes": CHANGES, "dirt": DIRT, "sound": SOUND}
CLASSES = {name: fault for group in GROUPS.values() for name, fault in group.items()}


class Run(NamedTuple):
    """What became of a log. wrong: see above. missed, outliers: of more than MISSED_SIGMAS. false_alarms, good:
    readings."""

    name: str
    seed: int
    way: str
    what: str
    verdict: str
    wrong: bool
    rmse_m: float
    missed: int
    outliers: int
    false_alarms: int
    good: int
    seconds: float

    @property
    def confident(self) -> bool:
        return self.wrong and self.verdict == CONSISTENT

    def __str__(self) -> str:
        return (
            f"{self.name} {self.seed} {self.way}, {self.what}: {self.verdict}, "
            f"{tables.mark(self.wrong, self.verdict)}, {self.rmse_m:.4g} m, "
            f"missed {self.missed} of {self.outliers}, false {self.false_alarms} of {self.good}"
        )


def make(name: str, seed: int) -> tuple[Simulation, str]:
    """The log of a class and a seed, always the same, and what it is: the flight and the specification of the fault."""
    own = list(CLASSES).index(name)
    take = hard_flights.take_abrupt if name == "abrupt" else hard_flights.take
    seen = take(seed + 5 * own, np.random.default_rng([own, seed]))
    spec = CLASSES[name](seen, seed)
    plan = Plan("", seen.lasts_s, seen.dt_s, tuple(seen.sigma), spec, PERFECT)
    return measure(seen.flight, plan, seen.sigma, f"{name} {seed}", [own, seed, 1]), f"{seen.name}, {spec}"


def run(name: str, seed: int) -> list[Run]:
    """A log filtered and smoothed."""
    simulated, what = make(name, seed)
    return [_judged(name, seed, smooth, simulated, what) for smooth in (False, True)]


def _judged(name: str, seed: int, smooth: bool, simulated: Simulation, what: str) -> Run:
    way, begun = "smooth" if smooth else "filter", time.process_time()
    try:
        found = pipeline.filter_log(simulated.log, FilterSettings(smooth=smooth))
    except FtprocError as error:
        return Run(name, seed, way, what, f"refused ({error})", False, np.nan, 0, 0, 0, 0, time.process_time() - begun)
    seconds = time.process_time() - begun
    error_m = np.sqrt(np.mean(((found.state[:, :3] - simulated.truth.position_m) ** 2).sum(1)))
    verdict = found.metadata["summary"]["trust"]["verdict"]
    far = is_far(found, simulated.truth.position_m)
    return Run(name, seed, way, what, verdict, far, float(error_m), *detection(found, simulated), seconds)


def detection(found: Trajectory, simulated: Simulation) -> tuple[int, int, int, int]:
    """Missed and all outliers, false alarms and all good readings. A reading after a step is neither."""
    code = simulated.truth.outlier
    assert code is not None
    off = simulated.log.measurement - simulated.clean
    off[:, 1] = wrap(off[:, 1])
    there, rejected = np.isfinite(off), (found.outlier != 0) & (found.outlier != MISSING)
    bad = there & (code > 0) & (code != CODES["step"]) & (np.abs(off) > MISSED_SIGMAS * np.array(simulated.sigma))
    good = there & (code == 0)
    return int((bad & ~rejected).sum()), int(bad.sum()), int((good & rejected).sum()), int(good.sum())


HEADER = ("class", "runs", "wrong", "and consistent", "consistent", "missed %", "false alarms %", "seconds")


def row(name: str, runs: Iterable[Run]) -> tuple[str, ...]:
    """The row of a class, or of a group. Missed and false alarms: the mean of the shares of the runs."""
    each = list(runs)
    missed = [run.missed / run.outliers for run in each if run.outliers]
    false = [run.false_alarms / run.good for run in each if run.good]
    return (
        name,
        str(len(each)),
        str(sum(run.wrong for run in each)),
        str(sum(run.confident for run in each)),
        str(sum(run.verdict == CONSISTENT for run in each)),
        f"{100 * np.mean(missed):.1f}" if missed else "-",
        f"{100 * np.mean(false):.2f}" if false else "-",
        f"{sum(run.seconds for run in each):.0f}",
    )


def table(found: list[Run]) -> Iterator[tuple[str, ...]]:
    """A row for each class and each group that was run."""
    for group, faults in GROUPS.items():
        runs = [each for each in found if each.name in faults]
        names = [name for name in faults if any(each.name == name for each in runs)]
        yield from (row(name, (each for each in runs if each.name == name)) for name in names)
        if len(names) > 1:
            yield row(f"all {group}", runs)
    if len({each.name for each in found}) > 1:
        yield row("all with a fault", (each for each in found if each.name not in SOUND))


def main() -> None:
    """Print the table."""
    given = tables.arguments(__doc__, CLASSES)
    jobs = [(name, seed) for name in given.names for seed in given.seeds]
    found = list(tables.spread(run, jobs, given))
    tables.show(HEADER, table(found))


if __name__ == "__main__":
    main()
