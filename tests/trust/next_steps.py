"""The table of next steps: runs that are suspect for different causes, and what their first step makes of them.

    python -m tests.trust.next_steps -j 2

A step that the program can try is run. One that asks the engineer is done as he would who knows the flight: stretches
of outliers become lines of decisions, the noise is the instrument's, the log of another station is fused. A step helps
if it makes the error smaller, or the verdict better with an estimate inside its sigmas; it deceives if the run is
consistent then, and the error larger or the estimate outside.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ftproc import pipeline
from ftproc.batch import trying
from ftproc.core import threads
from ftproc.core.model.frames import from_cartesian
from ftproc.files.decisions import Decisions
from ftproc.files.reading import logs
from ftproc.fusion import flight as fusion
from ftproc.fusion import range_file
from ftproc.long_records import joined
from ftproc.quality.next_steps import Step
from ftproc.quality.verdict import CONSISTENT, LEVELS, level_of
from ftproc.records import COMPONENTS, ENDS, REJECTED, FloatArray, Line, MeasurementLog, Trajectory
from ftproc.settings import FilterSettings
from ftproc.simulation import Simulation, simulate
from tests.trust import faulty_logs, runs, tables

PLAIN, SMOOTH = FilterSettings(), FilterSettings(smooth=True)
BETTER, WORSE = 0.95, 1.02  # of the error
LONG = 5  # outliers in a row that the engineer names
TRACKS = "all.offset=3:30-50:40-400,isolated=0.01"
OTHER_M = (4000.0, -3000.0, 0.0)  # the other station's place


class Case(NamedTuple):
    """A log with its truth, and how it is filtered."""

    flight: Simulation
    settings: FilterSettings


class Outcome(NamedTuple):
    """A run that is not consistent, its first step, and the run with that; after: None where there is nothing to run.
    far: whether that lies outside its sigmas."""

    cause: str
    verdict: str
    error_m: float
    step: str
    after: str | None = None
    error_after_m: float = np.nan
    far: bool = False

    @property
    def helps(self) -> bool:
        """The error is smaller, or the verdict rightly better."""
        if self.after is None or self.deceives:
            return False
        smaller = self.error_after_m < BETTER * self.error_m
        better = LEVELS.index(self.after) < LEVELS.index(self.verdict) and not self.far
        return smaller or (better and self.error_after_m <= WORSE * self.error_m)

    @property
    def deceives(self) -> bool:
        """It is consistent, and worse or wrong."""
        return self.after == CONSISTENT and (self.far or self.error_after_m > WORSE * self.error_m)


def _flown(seed: int, outliers: str | None = None, scenario: str = "manoeuvre") -> Simulation:
    return simulate(scenario, seed=seed, dt_s=0.1, duration_s=60, outliers=outliers)


def _altered(flight: Simulation, change: Callable[[pd.DataFrame], None]) -> Simulation:
    """The flight with a change of its log's table."""
    names = ("range_m", "azimuth_rad", "elevation_rad")
    table = pd.DataFrame({"time_s": flight.log.time_s, **dict(zip(names, flight.log.measurement.T, strict=True))})
    change(table)
    return replace(flight, log=logs.read(table))


def _set_back(table: pd.DataFrame) -> None:
    table.loc[300:, "time_s"] -= 5.0


def _without_ranges(table: pd.DataFrame) -> None:
    table.loc[200:399, "range_m"] = np.nan


def _few(table: pd.DataFrame) -> None:
    table.loc[table.index % 50 > 0, ["range_m", "azimuth_rad", "elevation_rad"]] = np.nan


#: Cause -> the log and how it is filtered.
CASES: dict[str, Callable[[], Case]] = {
    "noise specified too small": lambda: Case(_flown(6), replace(SMOOTH, noise=(0.5, 2e-5, 2e-5))),
    "process noise too small": lambda: Case(_flown(8), replace(SMOOTH, jerk_psd_m2ps5=1e-4)),
    "gate too small": lambda: Case(_flown(9), replace(SMOOTH, gate=1.5)),
    "no editing": lambda: Case(_flown(10), replace(SMOOTH, editing="none")),
    "a method without editor": lambda: Case(_flown(14), replace(SMOOTH, method="ukf")),
    "a method of channels": lambda: Case(_flown(14), replace(PLAIN, method="gate")),
    "recursive editing": lambda: Case(_flown(12, "patch=4:10-40:30-200"), replace(PLAIN, editing="forward")),
    "live editing": lambda: Case(_flown(3, TRACKS), replace(PLAIN, editing="live")),
    "a filter over a gap": lambda: Case(_flown(4, "gap=1:8-9"), PLAIN),
    "three patches of all components": lambda: Case(_flown(3, TRACKS), SMOOTH),
    "another target for 20 s": lambda: Case(_flown(7, "all.other=1:20s:60-300"), SMOOTH),
    "40 % isolated outliers": lambda: Case(_flown(4, "isolated=0.4:6-300"), SMOOTH),
    "a step of the range": lambda: Case(_flown(5, "range.step=1:20-50", "manoeuvre-clean"), SMOOTH),
    "another lobe": lambda: Case(faulty_logs.make("another lobe", 13).simulated, SMOOTH),
    "a clock that jumps": lambda: Case(_flown(5, "clock=1:1-2", "manoeuvre-clean"), SMOOTH),
    "a clock set back": lambda: Case(_altered(_flown(3, "none", "cruise"), _set_back), SMOOTH),
    "ranges missing for 20 s": lambda: Case(_altered(_flown(6, "none", "manoeuvre-clean"), _without_ranges), SMOOTH),
    "13 readings": lambda: Case(_altered(_flown(6, "none", "manoeuvre-clean"), _few), SMOOTH),
    "noise correlated over seconds": lambda: Case(_flown(5, "correlation=4", "cruise"), SMOOTH),
    "errors on one side": lambda: Case(faulty_logs.make("one-sided errors", 0).simulated, SMOOTH),
}  # fmt: skip


def outcome(cause: str) -> Outcome:
    """A cause's run, and that with its first step."""
    flight, settings = CASES[cause]()
    filtering = pipeline.Filtering(flight.log, settings, None)
    before = _whole(filtering)
    trust = before.metadata["summary"]["trust"]
    found = trying.steps(filtering, before.metadata["summary"], lambda changed: "")
    if not found:
        return Outcome(cause, level_of(trust), _error_m(before, flight), "-", level_of(trust))
    step = next(each for each in filtering.next_steps if each.advice == found[0]["advice"])
    done = _done(step, before, Case(flight, settings))
    said = Outcome(cause, level_of(trust), _error_m(before, flight), step.advice)
    if done is None:
        return said
    after, of_log = done
    if of_log and step.advice.startswith("reject the rows"):  # what it says is about the others
        kept = ~(after.outlier == REJECTED).all(1)
        before, after = _rows(before, kept), _rows(after, kept)
        said = said._replace(error_m=_error_m(before, flight))
    far = runs.is_far(after, _true(after, flight, of_log))
    judged = level_of(after.metadata["summary"]["trust"])
    return said._replace(after=judged, error_after_m=_error_m(after, flight, of_log), far=far)


def run(cause: str) -> list[Outcome]:
    """The same for `tables.spread`."""
    return [outcome(cause)]


def _whole(filtering: pipeline.Filtering) -> Trajectory:
    return replace(joined(list(filtering.parts())), metadata=filtering.metadata)


def _rows(found: Trajectory, rows: NDArray[np.bool_]) -> Trajectory:
    """Some rows, as far as errors need them."""
    return replace(
        found, row=found.row[rows], time_s=found.time_s[rows], state=found.state[rows], sigma=found.sigma[rows]
    )


def _true(found: Trajectory, flight: Simulation, by_row: bool) -> FloatArray:
    """(n, 3) true positions at the rows; of a log's rows, or at its times."""
    if by_row:
        return flight.truth.position_m[found.row]
    return np.stack([np.interp(found.time_s, flight.truth.time_s, axis) for axis in flight.truth.position_m.T], 1)


def _error_m(found: Trajectory, flight: Simulation, by_row: bool = True) -> float:
    off = found.state[:, :3] - _true(found, flight, by_row)
    return float(np.sqrt(np.nanmean((off**2).sum(1))))


def _done(step: Step, before: Trajectory, case: Case) -> tuple[Trajectory, bool] | None:
    """What comes of a step, and whether its rows are the log's; None where there is nothing to run."""
    log, settings = case.flight.log, case.settings
    if step.settings is not None:
        return pipeline.filter_log(log, step.settings), True
    if "write_decisions" in step.options:
        decided = _decided(before, case, step.advice)
        return pipeline.filter_log(decided, settings), True
    if "noise" in step.options:
        return pipeline.filter_log(log, replace(settings, noise=case.flight.sigma)), True
    if "--fuse" in step.typed:
        return _fused(case), False
    return None


def _decided(before: Trajectory, case: Case, advice: str) -> MeasurementLog:
    """The log with the lines that the engineer writes who knows which stretches are wrong."""
    flight, log = case.flight, case.flight.log
    lines: list[Line] = []
    if advice.startswith("reject the rows"):
        first, last = map(float, advice.partition("all,")[2].split(",")[:2])
        lines = [Line(2, "all", ENDS[1], first, last, "bad")]
    else:
        assert flight.truth.outlier is not None
        for c, component in enumerate(COMPONENTS):
            bad = np.r_[0, (flight.truth.outlier[:, c] != 0).astype(int), 0]
            for low, high in np.flatnonzero(np.diff(bad)).reshape(-1, 2).tolist():
                if high - low >= LONG:
                    lines.append(Line(len(lines) + 2, component, ENDS[1], low, high - 1, "bad"))
    return Decisions("d.csv", "0", tuple(lines)).applied(log) if lines else log


def _fused(case: Case) -> Trajectory:
    """The flight, seen by another station too."""
    flight = case.flight
    other = from_cartesian(flight.truth.position_m - np.array(OTHER_M))
    other += np.random.default_rng(1).standard_normal(other.shape) * flight.sigma
    time_s = flight.truth.time_s
    with tempfile.TemporaryDirectory() as folder:
        text = ""
        for name, times, reading, place in (
            ("one", flight.log.time_s, flight.log.measurement, (0.0, 0.0, 0.0)), ("other", time_s, other, OTHER_M),
        ):  # fmt: skip
            columns = ("range_m", "azimuth_rad", "elevation_rad")
            table = pd.DataFrame({"time_s": times, **dict(zip(columns, reading.T, strict=True))})
            table.to_csv(Path(folder, f"{name}.csv"), index=False)
            where = "\n".join(
                f"{key} = {value}" for key, value in zip(("east_m", "north_m", "up_m"), place, strict=True)
            )
            clock = 0 if name == "other" else 0.1
            text += f'[station.{name}]\nlog = "{name}.csv"\n{where}\nclock_offset_sigma_s = {clock}\n'
        Path(folder, "range.toml").write_text(text)
        return fusion.fuse(range_file.load(str(Path(folder, "range.toml"))), SMOOTH).trajectory


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("causes", nargs="*", metavar="CAUSE")
    parser.add_argument("-j", "--processes", type=int, default=threads.available())
    given = parser.parse_args()
    names = [(cause,) for cause in given.causes or CASES]
    found = list(tables.spread(run, names, tables.Given(range(1), (), given.processes)))
    header = ("cause", "verdict", "error m", "first step", "then", "error m", "helps")
    rows = [
        (each.cause, each.verdict, f"{each.error_m:.3g}", each.step, each.after or "-", f"{each.error_after_m:.3g}",
         "DECEIVES" if each.deceives else "yes" if each.helps else "no")
        for each in found
    ]  # fmt: skip
    tables.show(header, rows)
    print(f"{sum(each.helps for each in found)} of {len(found)} help, {sum(each.deceives for each in found)} deceive")


if __name__ == "__main__":
    main()
