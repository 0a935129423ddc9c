"""The kinds of flight by name, each placed relative to the station."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ftproc.simulation.flights.abrupt import ABRUPT
from ftproc.simulation.flights.aerodynamic import AIR_STEP_S, CRAFTS, Craft, aerodynamic
from ftproc.simulation.flights.aircraft import Airframe, fly, follow, placed
from ftproc.simulation.flights.kinematics import (
    GRAVITY_MPS2,
    LEAD_S,
    Flight,
    constant_acceleration,
    flown,
    gusts,
    integrate,
    smoothed,
)
from ftproc.simulation.flights.unsteered import UNSTEERED

FIGHTER = Airframe(
    speed_mps=(140, 290), turn_g=(1.5, 5.0), turn_rad=(0.5, 2.8), climb_rad=(0.1, 0.5), pull_g=(0.5, 2.0),
    thrust_mps2=(2.0, 6.0), onset_s=(1.0, 2.0), leg_s=(3, 12), height_m=(1500, 7000), area_m=(6e3, 12e3),
    radius_m=5e3, gust_mps2=0.25, step_s=0.05,
)  # fmt: skip
LIGHT = Airframe(
    speed_mps=(40, 85), turn_g=(1.05, 1.8), turn_rad=(0.5, 4.5), climb_rad=(0.03, 0.12), pull_g=(0.1, 0.35),
    thrust_mps2=(0.3, 1.0), onset_s=(1.5, 3.0), leg_s=(8, 40), height_m=(400, 2500), area_m=(2e3, 6e3),
    radius_m=2e3, gust_mps2=0.35, step_s=0.05,
)  # fmt: skip
AIRLINER = Airframe(
    speed_mps=(130, 250), turn_g=(1.02, 1.11), turn_rad=(0.2, 1.8), climb_rad=(0.01, 0.06),
    pull_g=(0.03, 0.1), thrust_mps2=(0.1, 0.4), onset_s=(5.0, 9.0), leg_s=(30, 120),
    height_m=(3000, 11000), area_m=(50e3, 65e3), radius_m=25e3, gust_mps2=0.06, step_s=0.25, closest_m=20e3,
)  # fmt: skip
HELICOPTER = Airframe(
    speed_mps=(12, 65), turn_g=(1.02, 1.3), turn_rad=(0.5, 3.1), climb_rad=(0.03, 0.15), pull_g=(0.05, 0.2),
    thrust_mps2=(0.4, 1.2), onset_s=(2.0, 4.0), leg_s=(8, 30), height_m=(100, 800), area_m=(1500, 4000),
    radius_m=1200.0, gust_mps2=0.3, step_s=0.05, closest_m=300.0,
)  # fmt: skip
CRUISER = replace(
    LIGHT, speed_mps=(60, 120), turn_g=(1.02, 1.1), turn_rad=(0.2, 1.0), climb_rad=(0.01, 0.04),
    leg_s=(40, 120), area_m=(5e3, 10e3), radius_m=6e3, gust_mps2=0.15,
)  # fmt: skip

AIRFRAMES = {"fighter": FIGHTER, "light": LIGHT, "airliner": AIRLINER}


def _manoeuvring(airframe: Airframe) -> Callable[[np.random.Generator, float], Flight]:
    def build(rng: np.random.Generator, duration_s: float) -> Flight:
        flight = fly(airframe, duration_s, rng)
        away, bearing = rng.uniform(*airframe.area_m), rng.uniform(-np.pi, np.pi)
        return placed(flight, airframe, duration_s, away, bearing)

    return build


def _by_air(airframe: Airframe, craft: Craft) -> Callable[[np.random.Generator, float], Flight]:
    """The same, by the forces of the air; every other one slips to the side at times."""
    meant = _manoeuvring(replace(airframe, gust_mps2=0.0))

    def build(rng: np.random.Generator, duration_s: float) -> Flight:
        path = meant(rng, duration_s)
        force = aerodynamic(craft, path, bool(rng.random() < 0.5), rng)
        start, velocity, _ = (each[0] for each in path.at(np.array([-LEAD_S])))
        return flown(force, duration_s, start, velocity, AIR_STEP_S)

    return build


def _overhead(rng: np.random.Generator, duration_s: float) -> Flight:
    """A pass 1 to 3 degrees from the zenith at its midpoint."""
    airframe = replace(FIGHTER, gust_mps2=0.15)
    speed, heading = rng.uniform(120.0, 250.0), rng.uniform(-np.pi, np.pi)
    lead = 10.0
    knots = round((lead + duration_s + 10.0) / airframe.step_s)
    drift = rng.uniform(-0.15, 0.15)  # of heading over the pass, rad
    initial = (speed, heading - drift / 2, np.zeros(3))
    flight = follow([(knots, 0.0, 0.0, drift)], initial, airframe, lead, rng)
    middle, velocity, _ = flight.at(np.array([duration_s / 2]))
    height = rng.uniform(2500.0, 6000.0)
    off = height * np.tan(np.deg2rad(rng.uniform(1.0, 3.0))) * rng.choice([-1.0, 1.0])
    along = velocity[0, :2] / np.hypot(*velocity[0, :2])
    return flight.moved(np.array([-off * along[1], off * along[0], height]) - middle[0])


def _orbit(rng: np.random.Generator, duration_s: float) -> Flight:
    """Steady circles about a point near the station, as flown for calibration: range nearly constant."""
    airframe = replace(LIGHT, gust_mps2=0.15)
    speed, heading = rng.uniform(60.0, 110.0), rng.uniform(-np.pi, np.pi)
    radius, lead = rng.uniform(3000.0, 8000.0), 10.0
    turn = speed / radius * rng.choice([-1.0, 1.0])
    seconds = airframe.step_s * round((lead + duration_s + 10.0) / airframe.step_s)
    initial = (speed, heading, np.zeros(3))
    flight = follow([(round(seconds / airframe.step_s), 0.0, 0.0, turn * seconds)], initial, airframe, lead, rng)
    centre = np.array([-speed / turn * np.sin(heading), speed / turn * np.cos(heading)])
    offset = rng.uniform(-0.15, 0.15, 2) * radius
    return flight.moved(np.array([*(offset - centre), rng.uniform(800.0, 2500.0)]))


def _rocket(rng: np.random.Generator, duration_s: float) -> Flight:
    """Air-launched boost, ballistic coast to the apex, level flight after it."""
    step, onset_s = 0.05, rng.uniform(0.8, 1.6)
    bearing, rise = rng.uniform(-np.pi, np.pi), rng.uniform(0.5, 0.95)
    pointing = np.array([np.cos(rise) * np.cos(bearing), np.cos(rise) * np.sin(bearing), np.sin(rise)])
    gravity = np.array([0.0, 0.0, -GRAVITY_MPS2])
    net = rng.uniform(20.0, 32.0) * pointing + gravity
    velocity = rng.uniform(150.0, 230.0) * np.array([np.cos(bearing), np.sin(bearing), 0.05])
    fuse_s, boost_s = rng.uniform(4.0, 12.0), duration_s * rng.uniform(0.18, 0.26)
    coast_s = max(0.0, (velocity[2] + net[2] * boost_s) / GRAVITY_MPS2)
    n = round((duration_s + 20.0) / step)
    time = step * np.arange(n) - 10.0
    phases = np.zeros((n, 3))
    burning = (time >= fuse_s) & (time < fuse_s + boost_s)
    phases[burning] = net
    phases[(time >= fuse_s + boost_s) & (time < fuse_s + boost_s + coast_s)] = gravity
    gust, gust_velocity = gusts(n, step, 0.15, rng)
    acceleration = smoothed(phases, round(onset_s / step)) + gust
    away, off = rng.uniform(10e3, 25e3), bearing + rng.uniform(0.6, 2.2) * rng.choice([-1.0, 1.0])
    start = np.array([away * np.cos(off), away * np.sin(off), rng.uniform(4000.0, 9000.0)])
    return integrate(-10.0, step, acceleration, velocity + gust_velocity, start)


def _ship(rng: np.random.Generator, duration_s: float) -> Flight:
    """A steady speed, straight legs and slow turns, a mast somewhat above the station."""
    step, speed, away = 0.5, rng.uniform(3.0, 12.0), rng.uniform(1e3, 10e3)
    legs = round((duration_s + 20.0) / step / 100) + 2  # of 50 s, every other one straight
    rate = np.repeat(rng.uniform(-0.015, 0.015, legs) * (np.arange(legs) % 2), 100)
    rate = smoothed(rate[:, None], 40)[:, 0]
    course = rng.uniform(-np.pi, np.pi) + np.cumsum(rate) * step
    turning = np.stack([-np.sin(course), np.cos(course), np.zeros_like(course)], 1) * (speed * rate)[:, None]
    bearing = rng.uniform(-np.pi, np.pi)
    ahead = np.array([np.cos(course[0]), np.sin(course[0]), 0.0])
    start = np.array([away * np.cos(bearing), away * np.sin(bearing), rng.uniform(1.0, 20.0)])
    return integrate(-10.0, step, turning, speed * ahead, start)


def _zuo2021(rng: np.random.Generator, duration_s: float) -> Flight:
    """Section 3.1 of Zuo et al. 2021: the same flight whatever the seed."""
    position, velocity, acceleration = (
        np.array(v) for v in ((300.0, 346.0, 200.0), (40.0, 20.0, 10.0), (1.3, 1.7, 1.3))
    )
    return constant_acceleration(duration_s, position, velocity, acceleration)


#: Name -> builder of a flight that covers 0 to `duration_s`, in the station's local frame.
FLIGHTS: dict[str, Callable[[np.random.Generator, float], Flight]] = {
    "zuo2021": _zuo2021,
    "fighter": _manoeuvring(FIGHTER),
    "light": _manoeuvring(LIGHT),
    "airliner": _manoeuvring(AIRLINER),
    "helicopter": _manoeuvring(HELICOPTER),
    "cruiser": _manoeuvring(CRUISER),
    "overhead": _overhead,
    "orbit": _orbit,
    "rocket": _rocket,
    "ship": _ship,
    **{f"aerodynamic-{name}": _by_air(airframe, CRAFTS[name]) for name, airframe in AIRFRAMES.items()},
    **ABRUPT,
    **UNSTEERED,
}
