"""What nobody steers: bombs, shells, rockets, and stores that an aircraft releases. Their drag follows the Mach number,
the air has wind, and a shell drifts with its spin: no law that an estimator assumes holds exactly."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from ftproc.records import FloatArray
from ftproc.simulation.flights.aerodynamic import AERO_FIGHTER, AIR_STEP_S, aerodynamic
from ftproc.simulation.flights.air import Air, by_mach, density, sound_mps
from ftproc.simulation.flights.kinematics import DOWN_MPS2, GRAVITY_MPS2, LEAD_S, Flight, flown, heading, integrate

Draw = np.random.Generator

EJECTED_S = 0.1  # how long a store is pushed off
OFF_RAIL_MPS = 20.0  # speed at which a rocket leaves its rail


def _drag(air: Air, body_m2pkg: float, rise: float) -> Callable[[float, FloatArray], FloatArray]:
    """(3,) m/s2 of a body's drag at a height m, with a velocity m/s. body_m2pkg: its drag area over its mass far below
    the speed of sound. rise: of it at that speed."""

    def force(height_m: float, velocity: FloatArray) -> FloatArray:
        through = velocity - air.wind(height_m)
        speed = math.sqrt(float(through @ through))
        area = body_m2pkg * by_mach(speed / sound_mps(height_m), rise)
        return np.asarray(-0.5 * density(height_m) * area * speed * through)

    return force


def _log_uniform(rng: Draw, low: float, high: float) -> float:
    return float(low * (high / low) ** rng.random())


def _place(rng: Draw, near_m: float, far_m: float, height_m: float) -> tuple[FloatArray, FloatArray]:
    """A (3,) place at a distance from the station, and the (3,) direction in which it lies."""
    towards = heading(rng)
    return rng.uniform(near_m, far_m) * towards + np.array([0.0, 0.0, height_m]), towards


def _sideways(rng: Draw, towards: FloatArray, most: float) -> FloatArray:
    """A (3,) horizontal direction within `most` rad of one across the line of sight."""
    turn = rng.choice([-1.0, 1.0]) * np.pi / 2 + rng.uniform(-most, most)
    c, s = np.cos(turn), np.sin(turn)
    return np.array([c * towards[0] - s * towards[1], s * towards[0] + c * towards[1], 0.0])


def _bomb(rng: Draw, duration_s: float) -> Flight:
    """Level from an aircraft, with little drag or a tail that brakes it."""
    air = Air(rng, rng.uniform(2.0, 15.0), 0.0)
    height = GRAVITY_MPS2 / 2 * (duration_s + LEAD_S) ** 2 * rng.uniform(0.9, 1.1)
    start, towards = _place(rng, 3000.0, 7000.0, height)
    velocity = rng.uniform(150.0, 280.0) * _sideways(rng, towards, 1.2) + np.array([0.0, 0.0, rng.uniform(-20, 20)])
    resists = _drag(air, _log_uniform(rng, 4e-5, 1e-3), rng.uniform(0.8, 2.0))
    return flown(lambda t, p, v: DOWN_MPS2 + resists(float(p[2]), v), duration_s, start, velocity)


def _shell(rng: Draw, duration_s: float) -> Flight:
    """From the muzzle on, spinning: it drifts to the side as long as it falls across its axis."""
    air = Air(rng, rng.uniform(2.0, 12.0), 0.0)
    resists = _drag(air, _log_uniform(rng, 6e-5, 4e-4), rng.uniform(0.8, 2.0))
    start, towards = _place(rng, 800.0, 3000.0, 10.0)
    up = GRAVITY_MPS2 / 2 * (duration_s + 2 * LEAD_S) * rng.uniform(1.05, 1.3)
    velocity = up / math.tan(rng.uniform(0.7, 1.2)) * _sideways(rng, towards, 1.2) + np.array([0.0, 0.0, up])
    drift = rng.uniform(0.001, 0.01)

    def force(t: float, p: FloatArray, v: FloatArray) -> FloatArray:
        side = drift * GRAVITY_MPS2 * np.array([v[1], -v[0], 0.0]) / math.sqrt(float(v @ v))
        return np.asarray(DOWN_MPS2 + side + resists(float(p[2]), v))

    return flown(force, duration_s, start, velocity)


def _sounding(rng: Draw, duration_s: float) -> Flight:
    """A rocket from its rail, lit at time 0 or some time after it, burning in one or two stages, then coasting."""
    air = Air(rng, rng.uniform(2.0, 10.0), 0.0)
    resists, rise = _drag(air, _log_uniform(rng, 5e-5, 3e-4), rng.uniform(0.8, 2.0)), rng.uniform(1.2, 1.5)
    start, _ = _place(rng, 2000.0, 6000.0, 5.0)
    pointing, stages = heading(rng, rise), int(rng.integers(1, 3))
    burns = duration_s * rng.uniform(0.06, 0.12, stages)
    stands = duration_s * max(rng.uniform(-0.15, 0.15), 0.0)
    times = np.cumsum(np.column_stack([[stands, *rng.uniform(1.0, 3.0, stages - 1)], burns]))
    gained = GRAVITY_MPS2 * duration_s * rng.uniform(0.45, 2.0) / stages
    burning = list(pairwise(times))[::2]

    def force(t: float, p: FloatArray, v: FloatArray) -> FloatArray:
        speed = math.sqrt(float(v @ v))
        on_rail = t < burning[0][1] and speed < OFF_RAIL_MPS
        along = pointing if on_rail else v / speed
        thrust = 0.0
        for lit, out in burning:
            if lit <= t < out:
                thrust = (gained / (out - lit) + GRAVITY_MPS2) * (0.8 + 0.4 * (t - lit) / (out - lit))
        held = np.zeros(3) if on_rail else DOWN_MPS2
        return np.asarray(held + thrust * along + resists(float(p[2]), v))

    return flown(force, duration_s, start, np.zeros(3))


def _release(rng: Draw, duration_s: float) -> Flight:
    """An aircraft drops what is followed from there on: a store, whose brake or parachute may open."""
    away, towards = _place(rng, 3000.0, 7000.0, 0.0)
    drops = duration_s * rng.uniform(0.25, 0.5)
    falls = duration_s + LEAD_S - drops
    start = away + np.array([0.0, 0.0, GRAVITY_MPS2 / 2 * falls**2 * rng.uniform(0.9, 1.1) + 300.0])
    velocity = rng.uniform(150.0, 280.0) * _sideways(rng, towards, 1.2)
    path = integrate(-LEAD_S, drops + LEAD_S, np.zeros((2, 3)), velocity, start)
    carried = aerodynamic(AERO_FIGHTER, path, False, rng)
    opens = falls * rng.uniform(0.2, 0.6) + drops if rng.random() < 0.5 else math.inf
    areas, air = (_log_uniform(rng, 5e-5, 3e-4), _log_uniform(rng, 2e-3, 1e-2)), Air(rng, rng.uniform(2.0, 15.0), 0.0)
    free, braked = (_drag(air, area, rng.uniform(0.8, 2.0)) for area in areas)
    filling, thrown = rng.uniform(0.2, 0.6), np.array([0.0, 0.0, -rng.uniform(1.5, 4.0) / EJECTED_S])

    def force(t: float, p: FloatArray, v: FloatArray) -> FloatArray:
        if t < drops:
            return carried(t, p, v)
        share = min(max((t - opens) / filling, 0.0), 1.0)
        resists = (1 - share) * free(float(p[2]), v) + share * braked(float(p[2]), v)
        return np.asarray(DOWN_MPS2 + resists + (thrown if t < drops + EJECTED_S else 0.0))

    return flown(force, duration_s, start, velocity, AIR_STEP_S)


#: Name -> builder of a flight that covers 0 to `duration_s`, in the station's local frame.
UNSTEERED: dict[str, Callable[[Draw, float], Flight]] = {
    "bomb": _bomb,
    "shell": _shell,
    "sounding-rocket": _sounding,
    "release": _release,
}
