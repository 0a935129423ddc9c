"""From a scenario's name to a log and its truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ftproc.errors import UsageError
from ftproc.records import FloatArray, IntArray, MeasurementLog, Truth
from ftproc.simulation.contamination import contaminate
from ftproc.simulation.flights.kinds import FLIGHTS
from ftproc.simulation.flights.kinematics import Flight
from ftproc.simulation.further import measured, with_signal
from ftproc.simulation.instrument import (
    InstrumentErrors,
    echoes,
    gauss_markov_offsets,
    held,
    readable,
    rounded,
    servo_lag,
    strength,
    systematic,
    unit_noise,
)
from ftproc.simulation.outlier_spec import OutlierSpec, parse_outliers
from ftproc.simulation.sampling import jumps, kept_rows, row_count, sample_times, with_duplicates
from ftproc.simulation.scenarios import Plan, draw, find_scenario

MAX_DURATION_S = 1e5
MAX_ROWS = 10_000_000

# One child generator each, so that flight and noise do not depend on the outlier specification.
_STREAMS = (
    "plan",
    "flight",
    "times",
    "noise",
    "outliers",
    "gaps",
    "duplicates",
    "instrument",
    "clock",
    "further",
    "echoes",
)


@dataclass(frozen=True)
class Simulation:
    """A simulated log and its truth, row for row.

    truth.outlier: code of the injected outlier, 0 for none, see `contamination.CODES`. sigma: 1-sigma of the noise,
    range m, azimuth rad, elevation rad. clean: (n, 3) the readings with their noise but without outliers, missing
    values and rounding.
    """

    log: MeasurementLog
    truth: Truth
    sigma: tuple[float, float, float]
    clean: FloatArray


def simulate(
    scenario: str,
    *,
    seed: int = 0,
    duration_s: float | None = None,
    dt_s: float | None = None,
    noise: tuple[float, float, float] | None = None,
    outliers: str | None = None,
    instrument: InstrumentErrors | None = None,
) -> Simulation:
    """Fly one flight of a scenario and measure it from the station at the origin.

    scenario: a name in `list_scenarios()`. seed: of flight, noise and outliers; the same seed gives the same bytes.
    duration_s, dt_s: length of the record and sample interval; samples at 0 and at the end are both included. noise:
    1-sigma of range m, azimuth rad, elevation rad. outliers: a specification, see `GRAMMAR`; it replaces the
    scenario's own. instrument: errors of the station beside its white noise. None: from the scenario.

    A = atan2(y, x) in [-pi, pi), E = atan2(z, hypot(x, y)), range >= 0 (Zuo et al. 2021 eq. 3, read as
    arctangents). Sizes in sigmas are of this noise; where it is zero, of the scenario's.

    Raises UsageError for an unknown scenario, a bad value, or a record that would be too long.
    """
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise UsageError(f"The seed must be a whole number from 0, not {seed}.")
    streams = _streams(seed)
    own = draw(find_scenario(scenario), streams["plan"])
    plan = replace(
        own,
        duration_s=own.duration_s if duration_s is None else float(duration_s),
        dt_s=own.dt_s if dt_s is None else float(dt_s),
        noise=own.noise if noise is None else noise,
        outliers=own.outliers if outliers is None else outliers,
        instrument=instrument or own.instrument,
    )
    _check(plan)
    sigma = np.array([used or default for used, default in zip(plan.noise, own.noise, strict=True)])
    flight = FLIGHTS[plan.flight](streams["flight"], plan.duration_s)
    return measure(flight, plan, sigma, f"simulated {scenario}, seed {seed}", seed)


def _check(plan: Plan) -> None:
    for what, value in (("duration", plan.duration_s), ("sample interval", plan.dt_s)):
        if not (math.isfinite(value) and value > 0):
            raise UsageError(f"The {what} must be a positive number of seconds, not {value:g}.")
    if plan.dt_s > plan.duration_s:
        raise UsageError(f"The sample interval, {plan.dt_s:g} s, is longer than the record, {plan.duration_s:g} s.")
    if plan.duration_s > MAX_DURATION_S:
        raise UsageError(f"The duration is at most {MAX_DURATION_S:g} s, not {plan.duration_s:g} s.")
    rows = row_count(plan.duration_s, plan.dt_s)
    if rows > MAX_ROWS:
        raise UsageError(
            f"{plan.duration_s:g} s at {plan.dt_s:g} s are {rows} rows; at most {MAX_ROWS} are made. "
            "Use a longer sample interval."
        )
    if len(plan.noise) != 3 or not all(math.isfinite(s) and s >= 0 for s in plan.noise):
        values = ",".join(f"{s:g}" for s in plan.noise)
        raise UsageError(
            "The noise is three numbers from 0: range in m, azimuth and elevation in rad (1 sigma), "
            f"such as 5,0.0002,0.0002; not {values}."
        )


def measure(flight: Flight, plan: Plan, sigma: FloatArray, name: str, seed: int | Sequence[int]) -> Simulation:
    """The log of a flight that an instrument at the origin takes, and its truth, row for row.

    plan: its `flight` is not used. sigma: (3,) unit of sizes in sigmas, m, rad, rad.
    """
    streams = _streams(seed)
    spec, rng = parse_outliers(plan.outliers), streams["instrument"]
    grid = sample_times(plan.duration_s, plan.dt_s, spec.jitter, streams["times"])
    visible, hidden = (jumps(grid, each, streams["clock"]) for each in (spec.clock, spec.late))
    late = plan.instrument.stamp_jitter_s * rng.standard_normal(len(grid))
    taken = (np.clip(grid + late, grid[0], grid[-1]) if late.any() else grid) - hidden
    fades = plan.instrument.echo_db > 0
    echo_db = echoes(grid, plan.instrument, streams["echoes"]) if fades else np.zeros(len(grid))
    exact = systematic(flight.at(taken)[0], plan.instrument, echo_db) - servo_lag(flight, taken, plan.instrument)
    exact += gauss_markov_offsets(grid, plan.instrument, rng)
    usual = np.asarray(plan.noise * unit_noise(grid, spec.correlation_s, spec.tails_dof, streams["noise"]))
    noise, _ = contaminate(usual, spec.noise, sigma, plan.dt_s, streams["clock"])
    clean = exact + noise
    reading, code = contaminate(clean, spec.faults, sigma, plan.dt_s, streams["outliers"])
    reading, code = held(rounded(reading, plan.instrument), plan.instrument), held(code, plan.instrument)
    rows, fresh = _rows(grid, spec, streams)
    second = exact[rows] + plan.noise * streams["duplicates"].standard_normal((len(rows), 3))
    clean = np.where(fresh[:, None], second, clean[rows])
    reading = readable(np.where(fresh[:, None], second, reading[rows]))
    code = np.where(fresh[:, None], 0, code[rows]).astype(np.uint8)
    time = (grid + visible)[rows]
    order = np.argsort(time, kind="stable")
    log = MeasurementLog(
        name=name,
        time_s=time[order],
        measurement=reading[order],
        row=order,
        rows_in_file=len(rows),
        rows_out_of_order=int(np.sum(np.diff(time) < 0)),
        duplicate_times=int(np.sum(np.diff(time[order]) == 0)),
    )
    state = flight.at(log.time_s)
    log = measured(log, *state[:2], plan.further, streams["further"])
    if fades:
        found = strength(exact[:, 0], echo_db, plan.instrument, streams["echoes"])
        log = with_signal(log, found[rows][order])
    truth = Truth(name, log.time_s, *state, code[order])
    return Simulation(log, truth, plan.noise, readable(clean)[order])


def _streams(seed: int | Sequence[int]) -> dict[str, np.random.Generator]:
    return dict(zip(_STREAMS, np.random.default_rng(seed).spawn(len(_STREAMS)), strict=True))


def _rows(
    time: FloatArray, spec: OutlierSpec, streams: dict[str, np.random.Generator]
) -> tuple[IntArray, NDArray[np.bool_]]:
    """Sample numbers of the rows of the log, and a mask of those that are a second, fresh reading."""
    kept = np.flatnonzero(kept_rows(time, spec, streams["gaps"]))
    index, fresh = with_duplicates(len(kept), spec.duplicates, streams["duplicates"])
    return kept[index], fresh
