"""Flights whose forces change at once: parachute, impact, ignition, separation, touch-down, catapult."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from ftproc.records import FloatArray
from ftproc.simulation.flights.kinematics import DOWN_MPS2, GRAVITY_MPS2, LEAD_S, Flight, flown, heading

Draw = np.random.Generator


def _drag(velocity: FloatArray, terminal_mps: float) -> FloatArray:
    """Quadratic drag of what falls at this speed in the end."""
    return np.asarray(-GRAVITY_MPS2 / terminal_mps**2 * np.sqrt(velocity @ velocity) * velocity)


def _at(rng: Draw, near_m: float, far_m: float, height_m: float) -> FloatArray:
    away, towards = rng.uniform(near_m, far_m), heading(rng)
    return np.array([away * towards[0], away * towards[1], height_m])


def _event(rng: Draw, duration_s: float) -> float:
    return float(duration_s * rng.uniform(0.3, 0.65))


def _parachute(rng: Draw, duration_s: float) -> Flight:
    """A load falls, and its canopy opens in some tenths of a second."""
    opens, filling = _event(rng, duration_s), rng.uniform(0.2, 0.8)
    falling, hanging = rng.uniform(45.0, 80.0), rng.uniform(5.0, 9.0)

    def force(t: float, p: FloatArray, v: FloatArray) -> FloatArray:
        filled = min(max((t - opens) / filling, 0.0), 1.0)
        return DOWN_MPS2 + _drag(v, 1 / np.sqrt((1 - filled) / falling**2 + filled / hanging**2))

    height = falling * opens + hanging * (duration_s - opens) + 100.0
    return flown(force, duration_s, _at(rng, 1000.0, 4000.0, height), rng.uniform(30.0, 60.0) * heading(rng))


def _impact(rng: Draw, duration_s: float) -> Flight:
    """A body falls to the ground and stays there."""
    hits, brake = _event(rng, duration_s), rng.uniform(0.02, 0.06)
    velocity, terminal = rng.uniform(40.0, 180.0) * heading(rng, 0.2), rng.uniform(120.0, 300.0)

    def force(t: float, p: FloatArray, v: FloatArray) -> FloatArray:
        return DOWN_MPS2 + _drag(v, terminal) if t < hits else -v / brake

    return flown(force, duration_s, _at(rng, 800.0, 3000.0, GRAVITY_MPS2 / 2 * (hits + LEAD_S) ** 2), velocity)


def _staged(start: FloatArray, velocity: FloatArray, times: list[float], thrusts: list[float]) -> Flight:
    """Thrusts m/s2 along the flight path between times; the last time is the end."""
    stages = list(zip(pairwise(times), thrusts, strict=True))

    def force(t: float, p: FloatArray, v: FloatArray) -> FloatArray:
        thrust = sum(size for (first, last), size in stages if first <= t < last)
        return DOWN_MPS2 * (0.3 if t > times[0] else 1.0) + thrust * v / np.sqrt(v @ v) + _drag(v, 1500.0)

    return flown(force, times[-1] - LEAD_S, start, velocity)


def _ignition(rng: Draw, duration_s: float) -> Flight:
    """A missile is dropped, ignites, and burns out."""
    lights, burns = _event(rng, duration_s), duration_s * rng.uniform(0.1, 0.2)
    times, thrusts = [lights, lights + burns, duration_s + LEAD_S], [rng.uniform(300.0, 800.0) / burns, 0.0]
    start = _at(rng, 3000.0, 9000.0, 2000.0 + GRAVITY_MPS2 / 2 * (lights + LEAD_S) ** 2)
    return _staged(start, rng.uniform(150.0, 250.0) * heading(rng, 0.2), times, thrusts)


def _separation(rng: Draw, duration_s: float) -> Flight:
    """The first stage burns out and drops, and the second ignites after a pause."""
    ends, pause = _event(rng, duration_s), rng.uniform(0.5, 3.0)
    times, (first, second) = [-LEAD_S, ends, ends + pause, duration_s + LEAD_S], rng.uniform(25.0, 60.0, 2)
    start, velocity = _at(rng, 4000.0, 12000.0, 500.0), rng.uniform(80.0, 200.0) * heading(rng, 1.2)
    return _staged(start, velocity, times, [first, 0.0, second])


def _touchdown(rng: Draw, duration_s: float) -> Flight:
    """An aircraft comes down a glide path, touches down and brakes to a stop."""
    lands, speed, braking = _event(rng, duration_s), rng.uniform(50.0, 80.0), rng.uniform(2.0, 4.0)
    along, sink = heading(rng), rng.uniform(1.5, 4.0)

    def force(t: float, p: FloatArray, v: FloatArray) -> FloatArray:
        if t < lands:
            return np.zeros(3)
        rolling = np.sqrt(v[:2] @ v[:2])
        brake = -braking * np.array([v[0], v[1], 0.0]) / rolling if rolling > 0.1 else -v / 0.1
        return np.array([brake[0], brake[1], -v[2] / 0.06])

    start = _at(rng, 300.0, 2000.0, 10.0 + sink * (lands + LEAD_S))
    return flown(force, duration_s, start, speed * along - np.array([0.0, 0.0, sink]))


def _catapult(rng: Draw, duration_s: float) -> Flight:
    """An aircraft stands, is thrown off in two seconds, and climbs away."""
    shot, stroke = _event(rng, duration_s), rng.uniform(1.8, 2.6)
    along, throw, thrust = heading(rng), rng.uniform(25.0, 35.0), rng.uniform(2.0, 6.0)
    climb = np.array([0.0, 0.0, rng.uniform(0.5, 2.0)])

    def force(t: float, p: FloatArray, v: FloatArray) -> FloatArray:
        if t < shot:
            return np.zeros(3)
        return throw * along if t < shot + stroke else thrust * np.exp((shot - t) / 10.0) * along + climb

    return flown(force, duration_s, _at(rng, 200.0, 1500.0, 20.0), np.zeros(3))


#: Name -> builder of a flight that covers 0 to `duration_s`, in the station's local frame.
ABRUPT: dict[str, Callable[[Draw, float], Flight]] = {
    "parachute": _parachute,
    "impact": _impact,
    "ignition": _ignition,
    "separation": _separation,
    "touch-down": _touchdown,
    "catapult": _catapult,
}
