"""Faults that last of one station among several: found by the search for a single log, on the events of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.editing.lasting.curves import CLOCK, Curve, Setting
from ftproc.core.editing.lasting.search import search
from ftproc.core.editing.lasting.weighing import Found, Scene, late_of, with_even_runs
from ftproc.core.filtering.records import Model, Observations
from ftproc.core.identification.profile import median_level
from ftproc.core.work import Work
from ftproc.fusion.estimation.events import Events, Seen
from ftproc.records import FloatArray, IntArray

NEARLY_ALL = 0.05  # of a log, that a step leaves out, where it is an offset


class Step(NamedTuple):
    """From a time of its own clock, s, on (or until then) the readings of a component of a station are larger by a size
    m, rad, rad, or, where the component is CLOCK, its times by so many seconds; it was taken out."""

    station: str
    component: int
    time_s: float
    size: float


class Readings(NamedTuple):
    """stations: without the steps that were found. banned: (rows, 3) of each, readings of patches."""

    stations: list[Seen]
    banned: list[NDArray[np.bool_]]
    steps: tuple[Step, ...] = ()

    @classmethod
    def of(cls, stations: list[Seen]) -> Readings:
        """As they were read."""
        return cls(stations, [np.zeros(station.measurement.shape, bool) for station in stations])


class Decided(NamedTuple):
    """Events and what was decided on them: their log, possible (n, 3), the model, state (n, 9) and sigma (n, 9),
    leave-one-out residual (n, 3), and the rates of outliers (stations, 3, 3)."""

    events: Events
    log: Observations
    possible: FloatArray
    model: Model
    state: FloatArray
    sigma: FloatArray
    residual: FloatArray
    rates: FloatArray


def with_biases(stations: list[Seen], steps: Sequence[Step]) -> list[Seen] | None:
    """The stations with unknown biases where a step of what is taken as exact holds for all of a station's log, or
    nearly: that is no step, but an offset that the range file does not state. Of two stations either may have it, of
    more the one that steps. None without such."""
    found, names = list(stations), [station.name for station in stations]
    for step in steps:
        c, named = step.component, names.index(step.station)
        before = float(np.mean(stations[named].time_s < step.time_s))
        if c == CLOCK or stations[named].prior[c] > 0 or min(before, 1 - before) > NEARLY_ALL:
            continue
        for s in (0, 1) if len(stations) == 2 else (named,):
            station, prior = found[s], found[s].prior.copy()
            if c in station.components and stations[s].prior[c] == 0:
                prior[c] = np.hypot(prior[c], step.size)
                found[s] = station._replace(prior=prior, unstated=tuple(sorted({*station.unstated, c})))
    return found if any(a is not b for a, b in zip(found, stations, strict=True)) else None


def contradicted(stations: Sequence[Seen], weight: Sequence[FloatArray]) -> bool:
    """Whether most readings of a station are rejected, weight (rows, 3) of each: about such a flight no fault can be
    told from another."""
    return any(
        2 * (used > 0).sum() < np.isfinite(station.measurement).sum()
        for station, used in zip(stations, weight, strict=True)
    )


def find(decided: Decided, gate: float, jerk_known: bool, work: Work) -> list[Found]:
    """The faults that last, as far as they are certain enough to be taken out, and there is work left to weigh them."""
    events, log = decided.events, decided.log
    possible, taken_in, sigma = decided.possible > 0, log.weight.copy(), np.sqrt(decided.model.noise_variance)
    for s in range(len(decided.rates)):
        rows = np.flatnonzero(events.station == s)
        taken_in[rows] = with_even_runs(log.weight[rows], possible[rows], decided.residual[rows], sigma[s])
    setting = Setting(events.time_s, late_of(log, decided.state), events.station)
    at_median = median_level(decided.model)
    scene = Scene(
        log, possible, taken_in, setting, at_median, jerk_known, decided.rates, gate, decided.residual, decided.state,
        decided.sigma, work=work,
    )  # fmt: skip
    return [each for each in search(scene) if each.gain > odds.SURE]


def taken_out(readings: Readings, events: Events, found: Sequence[Found]) -> Readings:
    """The readings without the faults: steps are taken out of them, patches are banned."""
    stations, banned, steps = list(readings.stations), [each.copy() for each in readings.banned], list(readings.steps)
    n = len(events.time_s)
    for fault in found:
        for curve in fault.curves:
            station, rows = stations[curve.station], _rows(events, curve)
            if not fault.stays(n):
                banned[curve.station][rows, curve.component] = True
                continue
            time_s, z = station.time_s.copy(), station.measurement.copy()
            if curve.component == CLOCK:
                time_s[rows] -= curve.size[0]
            else:
                z[rows, curve.component] -= curve.size[0]
            stations[curve.station] = station._replace(time_s=time_s, measurement=z)
            edge = rows[0] if curve.end == n else rows[-1]
            steps.append(Step(station.name, curve.component, float(station.time_s[edge]), curve.size[0]))
    return Readings(stations, banned, tuple(steps))


def _rows(events: Events, curve: Curve) -> IntArray:
    """The rows of its station's log that a curve acts on."""
    at = np.arange(curve.begin, curve.end)
    rows: IntArray = events.row[at[events.station[at] == curve.station]]
    return rows
