"""Flights seen by several stations: who stands where, with what biases and clocks, and what each of them reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ftproc.core.model import stations as model
from ftproc.core.model.earth import Geodetic, place_at, seen_from
from ftproc.core.model.frames import wrap
from ftproc.errors import UsageError
from ftproc.records import FlagArray, FloatArray, MeasurementLog, Truth
from ftproc.simulation.contamination import CODES, contaminate
from ftproc.simulation.flights.kinds import FLIGHTS
from ftproc.simulation.flights.kinematics import Flight
from ftproc.simulation.further import OFFSET_M
from ftproc.simulation.further import measured as measured_beside
from ftproc.simulation.instrument import readable, unit_noise
from ftproc.simulation.outlier_spec import parse_outliers
from ftproc.simulation.sampling import kept_rows, sample_times

ANGLES, ALL, RANGE = (1, 2), (0, 1, 2), (0,)
ANGLE_PRIORS = (8e-4, 6e-4, 1.5e-4)  # rad, 1-sigma: azimuth zero, elevation zero, tilts
CLOCK_PRIOR_S = 0.08
TRUTH_S = 0.05  # between two rows of the truth
OTHER_TARGET_S = (12.0, 25.0)


@dataclass(frozen=True)
class Kind:
    """An instrument. measures: its components. rate_hz: range of its rate. noise: ranges of its noise, m and rad.
    range_prior_m: 1-sigma of its range bias. outliers: one specification is drawn. other_target: share of flights in
    which it follows another target for a while. further: what it measures beside range and azimuth, see `further`."""

    name: str
    measures: tuple[int, ...]
    rate_hz: tuple[float, float]
    range_noise_m: tuple[float, float]
    angle_noise_rad: tuple[float, float]
    range_prior_m: float
    outliers: tuple[str, ...]
    other_target: float = 0.0
    further: tuple[str, ...] = ()


_OPTICAL = (
    "isolated=0.08:6-300,offset=2:12-45:8-200,ramp=1:15-40:15-200,stuck=1,burst=1:10-30:10-120,nan=0.005",
    "isolated=0.06:6-400,offset=1:12-60:8-150,jitter=0.2,gap=1:3-8,zero=0.004",
)
_RADIO = (
    "isolated=0.1:6-300,offset=1:6-20:8-200,ramp=1:8-20:15-200,burst=1:4-12:10-120,nan=0.01",
    "isolated=0.07:6-300,offset=2:5-15:8-200,gap=1:4-10,start=4:15-200",
)
THEODOLITE = Kind("theodolite", ANGLES, (10.0, 30.0), (1.0, 1.0), (1e-4, 2.5e-4), 0.0, _OPTICAL)
RADAR = Kind("radar", ALL, (2.0, 8.0), (4.0, 10.0), (2.5e-4, 8e-4), 25.0, _RADIO, 0.4)
DOPPLER = replace(RADAR, other_target=0.0, further=("elevation", "range_rate"))
FLAT = Kind(
    "surveillance", (0, 1), (0.2, 0.3), (20.0, 40.0), (6e-4, 1.2e-3), 40.0, ("isolated=0.02:6-200,nan=0.01",),
    further=("flight_level",),
)  # fmt: skip
DME = Kind("dme", RANGE, (1.5, 3.0), (4.0, 10.0), (1.0, 1.0), 10.0, ("isolated=0.06:6-300,nan=0.01",))

#: Scenario -> its description, its stations, and the flights of which one is drawn with its duration.
RANGES: Mapping[str, tuple[str, tuple[Kind, ...], tuple[tuple[str, float], ...]]] = {
    "range-theodolites": (
        "three theodolites without any range; a fighter or a light aircraft",
        (THEODOLITE, THEODOLITE, THEODOLITE),
        (("fighter", 90.0), ("light", 120.0)),
    ),
    "range-radar": (
        "a radar and two theodolites; a fighter, a rocket or a cruiser",
        (RADAR, THEODOLITE, THEODOLITE),
        (("fighter", 100.0), ("rocket", 120.0), ("cruiser", 150.0)),
    ),
    "range-radars": (
        "two radars, neither clock is the reference; an airliner or a cruiser",
        (RADAR, RADAR),
        (("airliner", 300.0), ("cruiser", 240.0)),
    ),
    "range-dme": (
        "a radar, a DME and a theodolite; a light aircraft or a cruiser",
        (RADAR, DME, THEODOLITE),
        (("light", 150.0), ("cruiser", 180.0)),
    ),
}
ANY = "range"
#: A radar with unknown biases, and GNSS on board.
GNSS, GNSS_S, GNSS_M = "range-gnss", 1.0, (2.0, 2.0, 4.0)  # name, between positions, 1-sigma east, north, up
WRONG, WRONG_M = 0.02, 200.0  # share of wrong positions, and their size
#: Two radars without elevations that hear flight levels, and one with range rates. Is not drawn by ANY.
SURVEILLANCE = "range-surveillance"
APART = {GNSS: ((RADAR,), RANGES["range-radars"][2]), SURVEILLANCE: ((FLAT, FLAT, DOPPLER), (("airliner", 400.0),))}
DESCRIPTIONS = {
    ANY: "several stations on one flight: one of the four below is drawn; -o names a directory",
    **{name: text for name, (text, _, _) in RANGES.items()},
    SURVEILLANCE: "two radars with flight levels instead of elevations, and one with range rates; an airliner",
    GNSS: "a radar with unknown biases, and the positions of GNSS on board; an airliner or a cruiser",
}


@dataclass(frozen=True)
class SimulatedStation:
    """A station with its log. truth: the flight in its own axes, row for row with the log, and the outliers' codes.
    site: WGS-84. azimuth_from: how its file counts. prior, biases: (6,) 1-sigma and true values of range, azimuth and
    elevation bias m, rad, rad, tilts rad, clock offset s. sigma: (3,) noise."""

    name: str
    log: MeasurementLog
    truth: Truth
    site: Geodetic
    azimuth_from: str
    prior: FloatArray
    biases: FloatArray
    sigma: FloatArray


class Gnss(NamedTuple):
    """time_s (n,), and (n, 3) latitude deg, longitude deg and height m."""

    time_s: FloatArray
    place: FloatArray


@dataclass(frozen=True)
class SimulatedRange:
    """A flight, x east, y north, z up at the origin in true time, the stations that saw it, and the positions of GNSS
    on board, if there are such."""

    origin: Geodetic
    truth: Truth
    stations: tuple[SimulatedStation, ...]
    gnss: Gnss | None = None


def simulate_range(scenario: str, seed: int = 0, duration_s: float | None = None) -> SimulatedRange:
    """A flight of a scenario of RANGES, or of any for `range`, seen by its stations; of a seed always the same.

    Raises UsageError for a duration that is none.
    """
    rng = np.random.default_rng([seed, 21])
    name = scenario if scenario in RANGES else list(RANGES)[rng.integers(len(RANGES))]
    kinds, flights = APART[scenario] if scenario in APART else RANGES[name][1:]
    name = scenario if scenario in APART else name
    flight_name, usual_s = flights[rng.integers(len(flights))]
    lasts = usual_s if duration_s is None else duration_s
    if not 10.0 <= lasts <= 1e5:
        raise UsageError(f"A flight for several stations lasts 10 to 100000 s, not {lasts:g} s.")
    flight = FLIGHTS[flight_name](rng, lasts)
    origin = (float(rng.uniform(-55, 65)), float(rng.uniform(-180, 180)), float(rng.uniform(0, 1500)))
    title = f"simulated {name}, seed {seed}"
    places = _places(flight, lasts, len(kinds), rng)
    reference = -1 if name in (GNSS, "range-radars") else int(rng.integers(len(kinds)))
    pressure_m = OFFSET_M * float(rng.standard_normal()) if name == SURVEILLANCE else 0.0
    stations = tuple(
        _station(kind, _called(kinds, k), origin, places[k], flight, lasts, (k == reference, pressure_m, rng))
        for k, kind in enumerate(kinds)
    )
    time_s = np.arange(0.0, lasts + 0.5 * TRUTH_S, TRUTH_S)
    gnss = _gnss(flight, lasts, origin, rng) if name == GNSS else None
    return SimulatedRange(origin, Truth(title, time_s, *flight.at(time_s)), stations, gnss)


def _gnss(flight: Flight, lasts: float, origin: Geodetic, rng: np.random.Generator) -> Gnss:
    time_s = np.arange(0.0, lasts, GNSS_S)
    point = flight.at(time_s)[0] + rng.standard_normal((len(time_s), 3)) * GNSS_M
    wrong = rng.random(len(time_s)) < WRONG
    point = point + np.where(wrong[:, None], WRONG_M * rng.standard_normal((len(time_s), 3)), 0.0)
    return Gnss(time_s, np.array([place_at(origin, each) for each in point]))


def _called(kinds: tuple[Kind, ...], k: int) -> str:
    kind = kinds[k].name
    return kind if [each.name for each in kinds].count(kind) == 1 else f"{kind}{k + 1}"


def _places(flight: Flight, lasts: float, count: int, rng: np.random.Generator) -> FloatArray:
    """(count, 3) on the ground round the flight, apart from each other, none right below it."""
    path = flight.at(np.linspace(0.0, lasts, 500))[0]
    middle, reach = path[:, :2].mean(0), float(np.ptp(path[:, :2], axis=0).max())
    reach = max(reach, 2.0 * float(path[:, 2].mean()), 1500.0)
    turn = rng.uniform(-np.pi, np.pi)
    bearing = turn + 2 * np.pi * (np.arange(count) + rng.uniform(-0.25, 0.25, count)) / max(count, 3)
    away = reach * rng.uniform(0.5, 0.9, count)
    level = rng.uniform(-30.0, 250.0, count)
    found = np.stack([middle[0] + away * np.cos(bearing), middle[1] + away * np.sin(bearing), level], 1)
    while float(np.min(np.linalg.norm(path[:, None, :2] - found[None, :, :2], axis=2))) < 0.05 * reach:
        found[:, :2] = middle + 1.1 * (found[:, :2] - middle)
    return found


def _station(
    kind: Kind, name: str, origin: Geodetic, ground: FloatArray, flight: Flight, lasts: float,
    draw: tuple[bool, float, np.random.Generator],
) -> SimulatedStation:  # fmt: skip
    is_reference, pressure_m, rng = draw
    ground = ground.copy()
    ground[2] -= (ground[0] ** 2 + ground[1] ** 2) / 2 / 6.378e6  # the earth is round
    site = tuple(round(value, digits) for value, digits in zip(place_at(origin, ground), (7, 7, 2), strict=True))
    place, axes = seen_from(origin, (site[0], site[1], site[2]))
    measured = np.isin([0, 1, 2], kind.measures)
    angles = bool(measured[1])
    prior = np.array([kind.range_prior_m, ANGLE_PRIORS[0], ANGLE_PRIORS[1], *[ANGLE_PRIORS[2]] * 2, CLOCK_PRIOR_S])
    prior *= [measured[0], measured[1], measured[2], angles, angles, not is_reference]
    biases = prior * rng.standard_normal(6)
    range_m, angle = (low * (high / low) ** rng.random() for low, high in (kind.range_noise_m, kind.angle_noise_rad))
    sigma = np.array([range_m, angle, angle * rng.uniform(0.8, 1.3)])
    spec = parse_outliers(str(rng.choice(kind.outliers)))
    rate_hz = rng.uniform(*kind.rate_hz)
    time = sample_times(lasts, 1 / float(np.round(rate_hz, 0 if rate_hz > 1 else 2)), spec.jitter, rng)
    if rng.random() < 0.25:
        time = time[time > rng.uniform(0.1, 0.3) * lasts]  # joins late
    time = time[kept_rows(time, spec, rng)]
    position, velocity, acceleration = flight.at(time)
    exact = model.measured(position, place, model.levelled(axes[None], biases[None, 3:5])[0])
    clean = exact + biases[:3] + sigma * unit_noise(time, spec.correlation_s, spec.tails_dof, rng)
    reading, code = contaminate(clean, spec.faults, sigma, float(np.median(np.diff(time))), rng)
    if rng.random() < kind.other_target:
        _follow_another(time, reading, code, rng)
    reading[:, ~measured], code[:, ~measured] = np.nan, 0
    reading[:, 1] = wrap(reading[:, 1])
    north = rng.random() < 0.4
    log = MeasurementLog(
        name, np.round(time + biases[5], 6), readable(reading),
        np.arange(len(time)), rows_in_file=len(time),
    )  # fmt: skip
    local = model.local(position, place, axes)
    if kind.further:
        log = measured_beside(log, local, velocity @ axes.T, kind.further, rng, (site[2], pressure_m))
    truth = Truth(name, log.time_s, local, velocity @ axes.T, acceleration @ axes.T, code.astype(np.uint8))
    where = (site[0], site[1], site[2])
    return SimulatedStation(name, log, truth, where, "north" if north else "x", prior, biases, sigma)


def _follow_another(time: FloatArray, reading: FloatArray, code: FlagArray, rng: np.random.Generator) -> None:
    """Readings of another target for a while, in place: it starts near and flies away."""
    lasts = rng.uniform(*OTHER_TARGET_S)
    first = time[0] + rng.uniform(0.15, 0.7) * (time[-1] - time[0])
    during = (time >= first) & (time < first + lasts)
    late = (time[during] - first)[:, None]
    offset = rng.choice([-1.0, 1.0], 3) * [rng.uniform(150, 600), rng.uniform(0.008, 0.03), rng.uniform(0.004, 0.02)]
    drift = rng.normal(size=3) * [8.0, 5e-4, 3e-4]
    reading[during] += offset + late * drift
    code[during] = CODES["other"]
