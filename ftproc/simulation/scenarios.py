"""The named scenarios: flights, sampling, noise and outliers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ftproc.errors import UsageError, nearest
from ftproc.simulation.instrument import PERFECT, InstrumentErrors

Range = tuple[float, float]


@dataclass(frozen=True)
class Scenario:
    """The distribution of the plans of a scenario; a pair is a range.

    flights: kinds in `flights.FLIGHTS`, one is drawn. duration_s: uniform. dt_s: one is drawn.
    range_noise_m, angle_noise_rad: 1-sigma, log-uniform; elevation has the angle noise times a draw of
    `elevation_ratio`. outliers: specifications (see `outlier_spec.GRAMMAR`), one is drawn. instrument: its
    errors. further: what is measured beside range and azimuth, see `further`. members: when given, one of these
    scenarios is drawn instead of all of the above.
    """

    name: str
    description: str
    flights: tuple[str, ...] = ()
    duration_s: Range = (60.0, 60.0)
    dt_s: tuple[float, ...] = (1.0,)
    range_noise_m: Range = (1.0, 1.0)
    angle_noise_rad: Range = (1e-4, 1e-4)
    elevation_ratio: Range = (1.0, 1.0)
    outliers: tuple[str, ...] = ("none",)
    instrument: InstrumentErrors = PERFECT
    members: tuple[Scenario, ...] = ()
    further: tuple[str, ...] = ("elevation",)


@dataclass(frozen=True)
class Plan:
    """One draw of a scenario; noise: 1-sigma of range m, azimuth rad, elevation rad."""

    flight: str
    duration_s: float
    dt_s: float
    noise: tuple[float, float, float]
    outliers: str
    instrument: InstrumentErrors
    further: tuple[str, ...] = ("elevation",)


def draw(scenario: Scenario, rng: np.random.Generator) -> Plan:
    """One plan. Values of a fixed range are drawn too, so that seeds stay comparable."""
    if scenario.members:
        scenario = scenario.members[rng.integers(len(scenario.members))]
    range_m = _log_uniform(scenario.range_noise_m, rng)
    angle_rad = _log_uniform(scenario.angle_noise_rad, rng)
    return Plan(
        flight=str(rng.choice(scenario.flights)),
        duration_s=float(np.round(rng.uniform(*scenario.duration_s))),
        dt_s=float(rng.choice(scenario.dt_s)),
        noise=(range_m, angle_rad, angle_rad * rng.uniform(*scenario.elevation_ratio)),
        outliers=str(rng.choice(scenario.outliers)),
        instrument=scenario.instrument,
        further=scenario.further,
    )


def _log_uniform(bounds: Range, rng: np.random.Generator) -> float:
    return float(bounds[0] * (bounds[1] / bounds[0]) ** rng.random())


_ZUO2021 = Scenario(
    "zuo2021",
    "Zuo et al. 2021, section 3.1: constant acceleration, 60 s at 1 Hz, range variance 10 m2",
    flights=("zuo2021",),
    range_noise_m=(10**0.5, 10**0.5),
    angle_noise_rad=(2e-4, 2e-4),  # not in the paper: those of a good theodolite
)
_MANOEUVRE = Scenario(
    "manoeuvre",
    "theodolite at 20 Hz, fighter with turns up to 5 g, climbs, straight legs; outliers, patches, a gap",
    flights=("fighter",),
    duration_s=(120.0, 120.0),
    dt_s=(0.05,),
    range_noise_m=(2.0, 5.0),
    angle_noise_rad=(1e-4, 3e-4),
    elevation_ratio=(0.8, 1.25),
    outliers=(
        "isolated=0.03:6-300,offset=1:4-30:8-200,ramp=1:6-30:20-200,stuck=1,burst=1:4-30:10-100,nan=0.01,gap=1:2-5",
    ),
)
_RADAR = Scenario(
    "radar",
    "surveillance radar at 1 Hz, airliner at 20-150 km; jittered times, 3 % outliers, a gap, duplicates",
    flights=("airliner",),
    duration_s=(600.0, 900.0),
    dt_s=(1.0,),
    range_noise_m=(20.0, 30.0),
    angle_noise_rad=(1e-3, 1e-3),
    outliers=("isolated=0.03:6-200,jitter=0.2,gap=1:8-20,duplicates=5",),
)
_SURVEILLANCE = replace(
    _RADAR,
    name="surveillance-2d",
    description="radar without elevation, every 4 s; flight levels of 25 ft, off by the air's pressure, 2 % garbled",
    dt_s=(4.0,),
    further=("flight_level",),
)
_DOPPLER = replace(
    _RADAR,
    name="radar-doppler",
    description="the radar with range rates too, 0.5 m/s (1 sigma), 2 % of them wrong",
    further=("elevation", "range_rate"),
)
_AMBIGUOUS = replace(
    _DOPPLER,
    name="radar-ambiguous",
    description="the same, its range rates known but for whole turns of 60 m/s: [range] rate_interval_mps = 60",
    further=("elevation", "range_rate", "ambiguous"),
)
_MARINE = Scenario(
    "marine",
    "a ship's radar without elevation, every 2.5 s; another ship at 1-10 km, cells of 22 m; 2 % outliers",
    flights=("ship",),
    duration_s=(600.0, 900.0),
    dt_s=(2.5,),
    range_noise_m=(5.0, 10.0),
    angle_noise_rad=(6e-3, 12e-3),
    outliers=("isolated=0.02:6-30",),
    instrument=replace(PERFECT, range_rounding_m=22.0),
    further=(),
)
_OVERHEAD = Scenario(
    "overhead",
    "theodolite at 20 Hz, pass near the zenith (elevation beyond 85 degrees); 2 % outliers",
    flights=("overhead",),
    duration_s=(120.0, 120.0),
    dt_s=(0.05,),
    range_noise_m=(2.0, 5.0),
    angle_noise_rad=(1e-4, 3e-4),
    outliers=("isolated=0.02:6-200",),
)
_CRUISE = Scenario(
    "cruise",
    "theodolite at 10 Hz, long straight legs and gentle turns; 1 % outliers",
    flights=("cruiser",),
    duration_s=(300.0, 300.0),
    dt_s=(0.1,),
    range_noise_m=(2.0, 5.0),
    angle_noise_rad=(1e-4, 3e-4),
    outliers=("isolated=0.01:6-200",),
)
_CALIBRATION = Scenario(
    "calibration",
    "theodolite at 10 Hz, steady circles round the station, azimuth passing +-180 degrees; no outliers",
    flights=("orbit",),
    duration_s=(600.0, 600.0),
    dt_s=(0.1,),
    range_noise_m=(2.0, 5.0),
    angle_noise_rad=(1e-4, 3e-4),
)
_ABRUPT = Scenario(
    "abrupt",
    "theodolite at 50 Hz; a parachute, impact, ignition, separation, touch-down or catapult; no outliers",
    flights=("parachute", "impact", "ignition", "separation", "touch-down", "catapult"),
    duration_s=(40.0, 60.0),
    dt_s=(0.02,),
    range_noise_m=(0.5, 5.0),
    angle_noise_rad=(5e-5, 3e-4),
)
_AERODYNAMIC = Scenario(
    "aerodynamic",
    "theodolite at 20 Hz, aircraft flown by lift, drag, thrust, side-slip, wind and gusts; no outliers",
    flights=("aerodynamic-fighter", "aerodynamic-light", "aerodynamic-airliner"),
    duration_s=(120.0, 120.0),
    dt_s=(0.05,),
    range_noise_m=(2.0, 5.0),
    angle_noise_rad=(1e-4, 3e-4),
)
_BALLISTIC = replace(
    _AERODYNAMIC,
    name="ballistic",
    description="theodolite at 20 Hz; a bomb, shell or rocket, with drag by Mach number and wind; no outliers",
    flights=("bomb", "shell", "sounding-rocket"),
    duration_s=(20.0, 40.0),
)
_RELEASE = replace(
    _BALLISTIC,
    name="release",
    description="theodolite at 20 Hz; a store dropped by an aircraft, every other one with a parachute; no outliers",
    flights=("release",),
    duration_s=(30.0, 50.0),
)

_DIRT = (
    "none",
    "isolated=0.01:6-300",
    "isolated=0.05:5-200,nan=0.01",
    "isolated=0.1:5-300,offset=1:4-20:8-200",
    "isolated=0.2:5-400,nan=0.005",
    "offset=2:4-30:8-300,ramp=2:6-30:15-300,stuck=2,burst=2:4-30:10-200,gap=1:3-12",
    "patch=3:4-30:8-200,isolated=0.01:6-200,all.patch=1:4-20:10-200",
    "start=6:15-300,isolated=0.03:5-150",
    "isolated=0.05:5-150,jitter=0.3,duplicates=10,gap=2:4-15",
    "isolated=0.03:6-200,correlation=0.5,nan=0.02,nanrun=4:4-20",
    "zero=0.006,isolated=0.02:6-300,all.isolated=0.01:6-200,stuck=2:3-12,tails=6",
    "isolated=0.02:6-300,round=0.25",
)
_ANY = Scenario("family", "", outliers=_DIRT, elevation_ratio=(0.7, 1.4), duration_s=(60.0, 240.0))
_FAMILY = Scenario(
    "family",
    "helicopter to rocket, 1-50 Hz, low to high noise, every kind of outlier: for training",
    members=(
        replace(
            _ANY, flights=("fighter",), dt_s=(0.02, 0.04, 0.05, 0.1, 0.2),
            range_noise_m=(1.0, 15.0), angle_noise_rad=(5e-5, 1e-3),
        ),
        replace(
            _ANY, flights=("light", "light", "cruiser", "orbit"), dt_s=(0.04, 0.05, 0.1, 0.2, 0.5, 1.0),
            range_noise_m=(1.0, 25.0), angle_noise_rad=(5e-5, 1.5e-3),
        ),
        replace(
            _ANY, flights=("airliner",), dt_s=(0.2, 0.5, 1.0), duration_s=(300.0, 900.0),
            range_noise_m=(10.0, 40.0), angle_noise_rad=(4e-4, 2.5e-3),
        ),
        replace(
            _ANY, flights=("helicopter",), dt_s=(0.05, 0.1, 0.2, 0.5),
            range_noise_m=(1.0, 10.0), angle_noise_rad=(1e-4, 1e-3),
        ),
        replace(
            _ANY, flights=("overhead",), dt_s=(0.02, 0.05, 0.1), duration_s=(60.0, 120.0),
            range_noise_m=(1.0, 10.0), angle_noise_rad=(5e-5, 5e-4),
        ),
        replace(
            _ANY, flights=("rocket",), dt_s=(0.02, 0.05, 0.1), duration_s=(90.0, 180.0),
            range_noise_m=(3.0, 20.0), angle_noise_rad=(5e-5, 5e-4),
        ),
    ),
)  # fmt: skip

_SCENARIOS: dict[str, Scenario] = {
    scenario.name: scenario
    for scenario in (
        _ZUO2021,
        replace(
            _ZUO2021,
            name="zuo2021-outliers",
            description="the same, 10 % of the ranges off by 20-200 m and a patch of 6 samples by 150 m",
            outliers=("range.isolated=0.1:20-200m,range.offset=1:6:150m",),
        ),
        _MANOEUVRE,
        replace(
            _MANOEUVRE,
            name="manoeuvre-clean",
            description="the same flights and noise without outliers, missing readings or a gap",
            outliers=("none",),
        ),
        _RADAR,
        _DOPPLER,
        _AMBIGUOUS,
        _SURVEILLANCE,
        _MARINE,
        _OVERHEAD,
        _CRUISE,
        _CALIBRATION,
        _ABRUPT,
        _AERODYNAMIC,
        _BALLISTIC,
        _RELEASE,
        _FAMILY,
    )
}


def list_scenarios() -> Mapping[str, str]:
    """Name -> one-line description, in the order to show them."""
    return {name: scenario.description for name, scenario in _SCENARIOS.items()}


def find_scenario(name: str) -> Scenario:
    """The scenario of that name. Raises UsageError with the names there are."""
    if name not in _SCENARIOS:
        hint = nearest(name, _SCENARIOS)
        raise UsageError(f'There is no scenario "{name}"{hint or "."} Choose one of {", ".join(_SCENARIOS)}.')
    return _SCENARIOS[name]
