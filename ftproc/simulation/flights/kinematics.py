"""The true motion of a flight: acceleration at evenly spaced knots; velocity and position are its exact integrals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ftproc.records import FloatArray

GRAVITY_MPS2 = 9.80665
DOWN_MPS2 = np.array([0.0, 0.0, -GRAVITY_MPS2])
STEP_S, MOST_STEPS = 0.005, 20_000  # of a point mass
LEAD_S = 2.0  # before time 0, and after the end
LOWEST_M = 3.0  # above the station's horizontal plane

#: (3,) acceleration m/s2 from the time s, and (3,) position m and velocity m/s; asked for once a step, in order.
Force = Callable[[float, FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class Flight:
    """Acceleration linear between knots, so that velocity and position are exact integrals at any time.

    start_s: time of the first knot. step_s: between knots. position, velocity, acceleration: (n, 3) at the
    knots, m, m/s, m/s2, in the station's local frame.
    """

    start_s: float
    step_s: float
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray

    def at(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position m, velocity m/s and acceleration m/s2, each (n, 3), at (n,) times in s."""
        cell = np.floor((time_s - self.start_s) / self.step_s).astype(np.int64)
        cell = np.clip(cell, 0, len(self.acceleration) - 2)
        s = (time_s - (self.start_s + cell * self.step_s))[:, None]
        p, v, a = self.position[cell], self.velocity[cell], self.acceleration[cell]
        jerk = (self.acceleration[cell + 1] - a) / self.step_s
        return (p + s * (v + s * (a / 2 + s * jerk / 6)), v + s * (a + s * jerk / 2), a + s * jerk)

    def moved(self, shift_m: FloatArray) -> Flight:
        """The same flight shifted by (3,) metres."""
        return replace(self, position=self.position + shift_m)


def integrate(
    start_s: float, step_s: float, acceleration: FloatArray, velocity: FloatArray, position: FloatArray
) -> Flight:
    """The flight with (n, 3) accelerations m/s2 at the knots; (3,) velocity and position at the first one."""
    a0, a1 = acceleration[:-1], acceleration[1:]
    v = np.vstack([velocity, velocity + np.cumsum(step_s * (a0 + a1) / 2, axis=0)])
    cells = step_s * v[:-1] + step_s**2 * (a0 / 3 + a1 / 6)
    p = np.vstack([position, position + np.cumsum(cells, axis=0)])
    return Flight(start_s, step_s, p, v, acceleration)


def flown(
    force: Force, duration_s: float, position: FloatArray, velocity: FloatArray, step_s: float = STEP_S
) -> Flight:
    """A point mass from (3,) m and m/s on, whose truth is the exact integral of the accelerations that it had; lifted
    where it would come below the station."""
    step = max(step_s, duration_s / MOST_STEPS)
    time = np.arange(-LEAD_S, duration_s + LEAD_S, step)
    acceleration = np.empty((len(time), 3))
    p, v = position.copy(), velocity.copy()
    for k, t in enumerate(time.tolist()):
        acceleration[k] = force(t, p, v)
        p += step * (v + step / 2 * acceleration[k])
        v += step * acceleration[k]
    begun = velocity + step / 2 * acceleration[0]  # what has stopped rests in the integral of the trapezoids, too
    flight = integrate(-LEAD_S, step, acceleration, begun, position)
    lift = max(0.0, LOWEST_M - float(flight.position[:, 2].min()))
    return flight.moved(np.array([0.0, 0.0, lift]))


def constant_acceleration(
    duration_s: float, position: FloatArray, velocity: FloatArray, acceleration: FloatArray
) -> Flight:
    """A single cell of constant (3,) acceleration m/s2 from (3,) position m and velocity m/s at time 0."""
    return integrate(0.0, duration_s, np.vstack([acceleration, acceleration]), velocity, position)


def heading(rng: np.random.Generator, rise: float = 0.0) -> FloatArray:
    """(3,) unit vector at a random bearing, `rise` rad above the horizontal."""
    turn = rng.uniform(-np.pi, np.pi)
    return np.array([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])


def smoothed(profile: FloatArray, width: int) -> FloatArray:
    """(n, k) command profiles with their steps smoothed over `width` knots (Hann window): roll-in takes time.

    The window's area is 1, so that the total of a command (speed, climb angle, heading) does not change.
    """
    window = np.sin(np.pi * (np.arange(width) + 0.5) / width) ** 2
    window /= window.sum()
    padded = np.pad(profile, ((width // 2, width - 1 - width // 2), (0, 0)), mode="edge")
    return np.stack([np.convolve(column, window, mode="valid") for column in padded.T], axis=1)


def gusts(n: int, step_s: float, rms_mps2: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """(n, 3) accelerations m/s2 by gusts of a stationary velocity, and the (3,) velocity at the first knot.

    The derivative of filtered white noise, not the noise itself: the integral of noise is a random walk, and a long
    flight would end in a dive.
    """
    width = max(4, round(3.0 / step_s))
    window = np.sin(2 * np.pi * (np.arange(width) + 0.5) / width)
    window *= rms_mps2 / np.sqrt(np.sum(window**2))
    white = rng.standard_normal((3, n + width - 1))
    acceleration = np.stack([np.convolve(row, window, mode="valid") for row in white], axis=1)
    return acceleration, -np.mean(np.cumsum(step_s * acceleration, axis=0), axis=0)
