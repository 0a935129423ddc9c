"""The table of faults in one station of a fused flight, each beside the same flight without it.

    python -m tests.trust.fused_faults 0-3 clock held       seeds 0 to 3, two faults; all of them where none is named
    python -m tests.trust.fused_faults 0-3 -v -j 2          a line for each run, by two processes

Wrong and consistent are as in `runs`. Named: reasons that were not there without the fault, or not of so bad a
verdict, name the station at fault, or only others.
"""

from __future__ import annotations

import re
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ftproc.errors import FtprocError
from ftproc.files.writing import ranges
from ftproc.fusion import flight, range_file
from ftproc.quality.verdict import CONSISTENT
from ftproc.records import FloatArray
from ftproc.settings import FilterSettings
from ftproc.simulation import RANGE_SCENARIOS, InstrumentErrors, SimulatedRange, parse_outliers, simulate_range
from ftproc.simulation.contamination import contaminate
from ftproc.simulation.instrument import held, readable, unit_noise
from ftproc.simulation.ranges import SimulatedStation
from tests.trust import tables
from tests.trust.runs import is_far
from tests.trust.tables import Bound, Given

SCENARIOS = tuple(name for name in RANGE_SCENARIOS if name not in ("range", "range-gnss", "range-surveillance"))
LASTS_S = 60.0
BOUND = Bound(wrong=0.2, confident=0.05)  # of all faults but a drift, a little above what is reached
SEEDS = 3
HELD = InstrumentErrors(range_held=4, azimuth_held=4, elevation_held=4)
Draw = np.random.Generator


class Fault(NamedTuple):
    """component: which the station must measure. apply: (n,) times and (n, 3) readings with the fault."""

    component: int
    apply: Callable[[SimulatedStation, Draw], tuple[FloatArray, FloatArray]]


def _readings(spec: str) -> Callable[[SimulatedStation, Draw], tuple[FloatArray, FloatArray]]:
    def apply(station: SimulatedStation, draw: Draw) -> tuple[FloatArray, FloatArray]:
        log = station.log
        dt_s = float(np.median(np.diff(log.time_s)))
        return log.time_s, contaminate(log.measurement, parse_outliers(spec).faults, station.sigma, dt_s, draw)[0]

    return apply


def _clock(station: SimulatedStation, draw: Draw) -> tuple[FloatArray, FloatArray]:
    time_s = station.log.time_s
    return time_s + 0.5 * (np.arange(len(time_s)) >= draw.uniform(0.3, 0.7) * len(time_s)), station.log.measurement


def _held(station: SimulatedStation, draw: Draw) -> tuple[FloatArray, FloatArray]:
    return station.log.time_s, held(station.log.measurement, HELD)


def _late(station: SimulatedStation, draw: Draw) -> tuple[FloatArray, FloatArray]:
    """Every second stamp is late by some hundredths of a second."""
    time_s = station.log.time_s
    late = np.where(draw.random(len(time_s)) < 0.5, draw.exponential(0.03, len(time_s)), 0.0)
    return np.sort(time_s + late), station.log.measurement


def _correlated(station: SimulatedStation, draw: Draw) -> tuple[FloatArray, FloatArray]:
    log = station.log
    return log.time_s, log.measurement + 2 * station.sigma * unit_noise(log.time_s, 2.0, None, draw)


def _drift(station: SimulatedStation, draw: Draw) -> tuple[FloatArray, FloatArray]:
    """Comes and goes once, up to 10 sigma."""
    log = station.log
    bump = np.sin(np.pi * np.linspace(0, 1, len(log))) ** 2
    return log.time_s, log.measurement + np.outer(bump, draw.choice([-10.0, 10.0], 3) * station.sigma)


FAULTS = {
    **{
        f"{component}-{size}": Fault(c, _readings(f"{component}.step=1:{size}"))
        for c, component in enumerate(("range", "azimuth", "elevation"))
        for size in (20, 50)
    },
    "clock": Fault(-1, _clock),
    "held": Fault(-1, _held),
    "correlated": Fault(-1, _correlated),
    "drift": Fault(-1, _drift),
    "late": Fault(-1, _late),
    "rounded": Fault(-1, _readings("round=5")),
    "noise": Fault(-1, _readings("burst=1:25%:5")),
}


class Run(NamedTuple):
    """A fused flight with a fault, and without it (`usual_m`, `usual_wrong`)."""

    scenario: str
    seed: int
    fault: str
    station: str
    rmse_m: float
    usual_m: float
    inside: float
    verdict: str
    wrong: bool
    usual_wrong: bool
    named: str
    seconds: float

    @property
    def ratio(self) -> float:
        return self.rmse_m / self.usual_m

    @property
    def confident(self) -> bool:
        return self.wrong and self.verdict == CONSISTENT

    @property
    def reported(self) -> bool:
        return self.verdict != CONSISTENT

    def __str__(self) -> str:
        return (
            f"{self.scenario} {self.seed} {self.fault} in {self.station}: {self.verdict}, "
            f"{tables.mark(self)}, {self.rmse_m:.4g} m, usually {self.usual_m:.4g} m"
            f"{' (wrong)' if self.usual_wrong else ''}, {100 * self.inside:.1f} % inside, "
            f"names {self.named or 'no station'}"
        )


class _Fused(NamedTuple):
    rmse_m: float
    inside: float
    wrong: bool
    verdict: str
    reasons: frozenset[str]


def _fused(simulated: SimulatedRange) -> _Fused:
    with tempfile.TemporaryDirectory() as room:
        ranges.write(simulated, str(Path(room) / "range"), None)
        found = flight.fuse(range_file.load(f"{room}/range/range.toml"), FilterSettings(smooth=True)).trajectory
    truth = simulated.truth
    known = (found.time_s >= truth.time_s[0]) & (found.time_s <= truth.time_s[-1])
    position = np.stack([np.interp(found.time_s, truth.time_s, axis) for axis in truth.position_m.T], 1)
    position[~known] = found.state[~known, :3]
    error, sigma = found.state[known, :3] - position[known], found.sigma[known, :3]
    trust = found.metadata["summary"]["trust"]
    reasons = frozenset(re.sub(r"[\d.]+ %", "", f"{trust['verdict']}: {each}") for each in trust["reasons"])
    return _Fused(
        float(np.sqrt((error**2).sum(1).mean())), float((np.abs(error) < 3 * sigma).all(1).mean()),
        is_far(found, position), trust["verdict"], reasons,
    )  # fmt: skip


def _named(simulated: SimulatedRange, station: str, reasons: frozenset[str]) -> str:
    """Whether reasons name the station at fault or only others: it, another, or nothing."""
    named = [s.name for s in simulated.stations if any(re.search(rf"\b{s.name}\b", reason) for reason in reasons)]
    return "" if not named else "it" if station in named else "another"


def able(simulated: SimulatedRange, fault: str) -> list[SimulatedStation]:
    """The stations that can have a fault: those that measure what it changes."""
    c = FAULTS[fault].component
    return [s for s in simulated.stations if c < 0 or np.isfinite(s.log.measurement[:, c]).any()]


def spoilt(simulated: SimulatedRange, fault: str, seed: int) -> tuple[SimulatedRange, str]:
    """The flight with a fault in one of its stations that can have it, and that station's name."""
    stations = able(simulated, fault)
    station = stations[seed % len(stations)]
    time_s, reading = FAULTS[fault].apply(station, np.random.default_rng([seed, list(FAULTS).index(fault)]))
    log = replace(station.log, time_s=np.round(time_s, 6), measurement=_readable(reading))
    others = (replace(station, log=log) if s is station else s for s in simulated.stations)
    return replace(simulated, stations=tuple(others)), station.name


def _readable(reading: FloatArray) -> FloatArray:
    return np.where(np.isfinite(reading), readable(reading), np.nan)


def run(faults: tuple[str, ...], scenario: str, seed: int) -> list[Run]:
    """A flight without a fault, and with each one of some."""
    simulated = simulate_range(scenario, seed, LASTS_S)
    usual = _fused(simulated)
    return [_run(simulated, usual, name, (scenario, seed)) for name in faults if able(simulated, name)]


def _run(simulated: SimulatedRange, usual: _Fused, name: str, which: tuple[str, int]) -> Run:
    changed, station = spoilt(simulated, name, which[1])
    begun = time.process_time()
    try:
        fused = _fused(changed)
    except FtprocError as error:
        refused = f"refused ({error})"
        return Run(*which, name, station, np.nan, usual.rmse_m, np.nan, refused, False, usual.wrong, "", 0.0)
    named = _named(simulated, station, fused.reasons - usual.reasons)
    return Run(
        *which, name, station, fused.rmse_m, usual.rmse_m, fused.inside, fused.verdict, fused.wrong, usual.wrong, named,
        time.process_time() - begun,
    )  # fmt: skip


HEADER = (
    "fault", "runs", "reported", "wrong", "confident and wrong", "median ratio", "worst", "in 3 sigma %", "names it",
    "another", "seconds",
)  # fmt: skip


def row(name: str, found: list[Run]) -> tuple[str, ...]:
    """The row of a fault. Ratios are of RMSE, to the same flight without the fault."""
    ratio = np.array([each.ratio for each in found])
    return (
        name,
        str(len(found)),
        str(sum(each.reported for each in found)),
        str(sum(each.wrong for each in found)),
        str(sum(each.confident for each in found)),
        f"{np.nanmedian(ratio):.2f}",
        f"{np.nanmax(ratio):.3g}",
        f"{100 * np.nanmean([each.inside for each in found]):.1f}",
        str(sum(each.named == "it" for each in found)),
        str(sum(each.named == "another" for each in found)),
        f"{sum(each.seconds for each in found):.0f}",
    )


def table(found: list[Run]) -> Iterator[tuple[str, ...]]:
    """A row for each fault, and for all of them but a drift, which the others may not show."""
    for name in FAULTS:
        if each := [run for run in found if run.fault == name]:
            yield row(name, each)
    yield row("all but drift", but_drift(found))


def but_drift(found: list[Run]) -> list[Run]:
    """The runs with a fault that the other stations show."""
    return [run for run in found if run.fault != "drift"]


def jobs(given: Given) -> list[tuple[tuple[str, ...], str, int]]:
    """What `run` takes: the faults, a scenario and a seed."""
    return [(tuple(given.names), scenario, seed) for scenario in SCENARIOS for seed in given.seeds]


def main() -> None:
    """Print the table."""
    given = tables.arguments(__doc__, FAULTS)
    found = list(tables.spread(run, jobs(given), given))
    tables.show(HEADER, table(found))


if __name__ == "__main__":
    main()
