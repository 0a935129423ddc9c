"""Logs with faults that they themselves betray, and clean and ordinarily dirty ones, with their truth.

The flights are not those of `ftproc simulate`: accelerations that fade and return (Singer), orbits, weaves, falls, seen
at other distances and rates. Each class of fault is a function that draws one fault for a flight.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.records import FloatArray, MeasurementLog

Draw = np.random.Generator


class Flight(NamedTuple):
    """A clean log: time_s (n,), position (m, 3) by a fine clock (m,) that goes beyond it on both sides, the noise
    (n, 3) and its 1-sigma (3,) m, rad, rad."""

    time_s: FloatArray
    fine_s: FloatArray
    position_m: FloatArray
    noise: FloatArray
    sigma: FloatArray

    def at(self, time_s: FloatArray) -> FloatArray:
        """(n, 3) positions at some times."""
        return np.stack([np.interp(time_s, self.fine_s, axis) for axis in self.position_m.T], 1)

    def seen(self, time_s: FloatArray | None = None) -> FloatArray:
        """(n, 3) readings at the log's times, or at those given, with the log's noise."""
        return from_cartesian(self.at(self.time_s if time_s is None else time_s)) + self.noise

    @property
    def middle(self) -> FloatArray:
        """(n,) bool: not near the ends."""
        n = len(self.time_s)
        return (np.arange(n) > 0.12 * n) & (np.arange(n) < 0.88 * n)


class Faulty(NamedTuple):
    """A log and its truth (n, 3) m, row for row, and what was done to it."""

    log: MeasurementLog
    position_m: FloatArray
    what: str


def fly(draw: Draw) -> Flight:
    """One of four kinds of flight with its sampling and noise."""
    kind = draw.integers(4)
    dt = float(draw.choice([0.04, 0.07, 0.125, 0.2, 0.25]))
    n = int(draw.uniform(70, 170) / dt)
    time = dt * np.arange(n)
    fine = np.arange(-8.0, time[-1] + 8.0, 0.005)
    position = (_singer, _orbit, _weave, _fall)[kind](draw, fine)
    sigma = np.array([draw.uniform(0.8, 9), draw.uniform(0.08e-3, 0.7e-3), draw.uniform(0.08e-3, 0.7e-3)])
    return Flight(time, fine, position, sigma * draw.standard_normal((n, 3)), sigma)


def _singer(draw: Draw, t: FloatArray) -> FloatArray:
    """Level flight whose acceleration is Gauss-Markov noise, of 2 to 15 m/s2 and some seconds."""
    from scipy.signal import lfilter

    step, fade, size = t[1] - t[0], draw.uniform(6, 20), np.array([1, 1, 0.4]) * draw.uniform(1, 12)
    keep = np.exp(-step / fade)
    noise = draw.standard_normal((len(t), 3)) * size * np.sqrt(1 - keep**2)
    acceleration = lfilter([1], [1, -keep], noise, axis=0)
    acceleration = lfilter([step / 0.5], [1, step / 0.5 - 1], acceleration, axis=0)  # nothing turns at once
    velocity = draw.uniform(60, 260) * _heading(draw) + np.cumsum(acceleration, 0) * step
    velocity -= (velocity.mean(0) - _heading(draw) * draw.uniform(20, 90)) * 0.8
    return _place(draw, 4000, 14000) + np.cumsum(velocity, 0) * step


def _orbit(draw: Draw, t: FloatArray) -> FloatArray:
    radius, speed = draw.uniform(900, 3500), draw.uniform(50, 160)
    turn = speed / radius * t * draw.choice([-1, 1]) + draw.uniform(0, 6)
    centre = _place(draw, 5000, 11000)
    return centre + np.stack([radius * np.cos(turn), radius * np.sin(turn), draw.uniform(-3, 5) * t], 1)


def _weave(draw: Draw, t: FloatArray) -> FloatArray:
    along, speed = _heading(draw), draw.uniform(70, 240)
    side = np.array([-along[1], along[0], 0.0])
    swing = draw.uniform(40, 400) * np.sin(2 * np.pi * t / draw.uniform(18, 45))
    rise = draw.uniform(10, 120) * np.sin(2 * np.pi * t / draw.uniform(25, 60))
    middle = 0.5 * (t[0] + t[-1])
    far = _place(draw, 3000, 9000)
    return far + np.outer(t - middle, along) * speed + np.outer(swing, side) + np.outer(rise, [0, 0, 1])


def _fall(draw: Draw, t: FloatArray) -> FloatArray:
    """Something lobbed high, with drag that grows with the speed."""
    start, velocity = _place(draw, 4000, 12000), draw.uniform(20, 200) * _heading(draw)
    drag = draw.uniform(0.005, 0.03)
    fallen = (1 - np.exp(-drag * (t - t[0]))) / drag
    up = draw.uniform(20, 90) * fallen - 9.8 / drag * ((t - t[0]) - fallen) * 0.02
    return start + np.outer(fallen, velocity) + np.outer(up, [0, 0, 1])


def _heading(draw: Draw) -> FloatArray:
    turn = draw.uniform(-np.pi, np.pi)
    return np.array([np.cos(turn), np.sin(turn), 0.0])


def _place(draw: Draw, near: float, far: float) -> FloatArray:
    return _heading(draw) * draw.uniform(near, far) + np.array([0, 0, draw.uniform(700, 4000)])


def _log(time: FloatArray, z: FloatArray, flight: Flight, what: str, true_s: FloatArray | None = None) -> Faulty:
    z = z.copy()
    z[:, 1] = wrap(z[:, 1])
    order = np.argsort(time, kind="stable")
    truth = flight.at(time if true_s is None else true_s)
    back = int((np.diff(time) < 0).sum())
    log = MeasurementLog("faulty", time[order], z[order], order, rows_out_of_order=back, rows_in_file=len(time))
    return Faulty(log, truth[order], what)


def _place_of(draw: Draw, flight: Flight, half: int) -> int:
    low, high = ((0.12, 0.48), (0.52, 0.88))[half]
    return int(draw.uniform(low, high) * len(flight.time_s))


# --- the classes --------------------------------------------------------------------------------------------------


def clean(draw: Draw, seed: int) -> Faulty:
    """Noise alone; every second one with times that jitter."""
    flight = fly(draw)
    if seed % 2:
        step = flight.time_s[1]
        flight = flight._replace(time_s=flight.time_s + draw.uniform(-0.2, 0.2, len(flight.time_s)) * step)
    return _log(flight.time_s, flight.seen(), flight, "clean")


def dirty(draw: Draw, seed: int) -> Faulty:
    """Isolated outliers, short patches, missing readings, a gap: what every log has."""
    flight = fly(draw)
    z, n = flight.seen(), len(flight.time_s)
    share = draw.uniform(0.002, 0.06)
    spike = draw.random((n, 3)) < share
    z += spike * draw.choice([-1, 1], (n, 3)) * np.exp(draw.uniform(np.log(7), np.log(300), (n, 3))) * flight.sigma
    for _ in range(draw.integers(0, 4)):
        c, first, length = draw.integers(3), draw.integers(n // 10, n - n // 10), draw.integers(4, 18)
        z[first : first + length, c] += draw.choice([-1, 1]) * draw.uniform(12, 120) * flight.sigma[c]
    z[draw.random((n, 3)) < draw.choice([0.0, 0.03])] = np.nan
    keep = np.ones(n, bool)
    if seed % 3 == 0:
        first = draw.integers(n // 5, 4 * n // 5)
        keep[first : first + int(draw.uniform(0.8, 2.5) / flight.time_s[1])] = False
    return _log(flight.time_s[keep], z[keep], flight, "dirty")


def step(size: float) -> Callable[[Draw, int], Faulty]:
    """A step of so many sigmas that stays; component and half of the flight go round."""

    def fault(draw: Draw, seed: int) -> Faulty:
        flight = fly(draw)
        c, k = seed % 3, _place_of(draw, flight, seed // 3 % 2)
        z, by = flight.seen(), draw.choice([-1, 1]) * size * flight.sigma[c]
        z[k:, c] += by
        return _log(flight.time_s, z, flight, f"{'rae'[c]} {by:+.4g} at {flight.time_s[k]:.2f} s")

    return fault


def steps(draw: Draw, seed: int) -> Faulty:
    """Several slips, in one component or in all, every second time among ordinary outliers."""
    flight = fly(draw)
    z, n = flight.seen(), len(flight.time_s)
    what = []
    for k in np.sort(draw.choice(np.flatnonzero(flight.middle), draw.integers(2, 4), replace=False)):
        c = draw.integers(3)
        by = draw.choice([-1, 1]) * draw.uniform(12, 90) * flight.sigma[c]
        z[k:, c] += by
        what.append(f"{'rae'[c]} {by:+.4g} at {flight.time_s[k]:.2f} s")
    if seed % 2:
        spike = draw.random((n, 3)) < 0.02
        z += spike * draw.choice([-1, 1], (n, 3)) * draw.uniform(8, 100, (n, 3)) * flight.sigma
    return _log(flight.time_s, z, flight, ", ".join(what))


def ambiguity(draw: Draw, seed: int) -> Faulty:
    """The range jumps by the length of an ambiguity, one time in three among outliers."""
    flight = fly(draw)
    k, by = (
        _place_of(draw, flight, seed % 2),
        float(draw.choice([-1.0, 1.0]) * draw.choice([29.98, 149.9, 749.5, 1498.96])),
    )
    z = flight.seen()
    by *= 1 if abs(by) > 8 * flight.sigma[0] else 10
    z[k:, 0] += by
    if seed % 3 == 0:
        spike = draw.random(z.shape) < 0.02
        z += spike * draw.choice([-1, 1], z.shape) * draw.uniform(8, 100, z.shape) * flight.sigma
    return _log(flight.time_s, z, flight, f"r {by:+.4g} at {flight.time_s[k]:.2f} s")


def lobe(draw: Draw, seed: int) -> Faulty:
    """The tracker locks again on another lobe: both angles jump at once, after a short loss of track or none."""
    flight = fly(draw)
    k, z = _place_of(draw, flight, seed % 2), flight.seen()
    by = draw.choice([-1, 1], 2) * draw.uniform(15, 80, 2) * flight.sigma[1:]
    z[k:, 1:] += by
    if seed % 2:
        z[k - draw.integers(2, 1 + int(1.0 / flight.time_s[1])) : k] = np.nan
    return _log(flight.time_s, z, flight, f"a {by[0]:+.4g} e {by[1]:+.4g} at {flight.time_s[k]:.2f} s")


def clock(draw: Draw, seed: int) -> Faulty:
    """The clock jumps: forward, backward (times that overlap), or without a trace in the times themselves."""
    flight = fly(draw)
    k, by = _place_of(draw, flight, seed % 2), float(draw.uniform(0.2, 2.0))
    time, z = flight.time_s, flight.seen()
    after = np.arange(len(time)) >= k
    if seed % 3 == 0:  # readings of another time under an even clock
        by *= draw.choice([-1, 1])
        z = flight.seen(time + after * by)
    elif seed % 3 == 1:
        time = time + after * by
    else:
        by = -by
        time = time + after * by
    what = f"clock {by:+.3g} s ({('hidden', 'forward', 'back')[seed % 3]}) at {flight.time_s[k]:.2f} s"
    return _log(time, z, flight, what)


def held(draw: Draw, seed: int) -> Faulty:
    """Readings that repeat the one before: some of them, or all at a fraction of the rate, in one component or all."""
    flight = fly(draw)
    z, n = flight.seen(), len(flight.time_s)
    components = [(0, 1, 2), (0,), (1,), (2,), (1, 2)][seed % 5]
    if seed % 2:
        source = np.arange(n)
        fresh = draw.random(n) > draw.uniform(0.3, 0.75)
        source = np.maximum.accumulate(np.where(fresh, source, 0))
        what = f"{100 * (1 - fresh.mean()):.0f} % held"
    else:
        every = int(draw.integers(2, 8))
        source = np.arange(n) // every * every
        what = f"every {every}"
    z[:, components] = z[source][:, components]
    if seed % 4 == 0:
        z = np.stack([np.round(z[:, 0], 2), np.round(z[:, 1], 6), np.round(z[:, 2], 6)], 1)
    return _log(flight.time_s, z, flight, f"{what} of {components}")


def resampled(draw: Draw, seed: int) -> Faulty:
    """Readings between which a slower instrument's have been interpolated linearly."""
    flight = fly(draw)
    z = flight.seen()
    components = [(0, 1, 2), (0,), (1,), (2,), (1, 2)][seed % 5]
    t, n = flight.time_s, len(flight.time_s)
    if seed % 2:
        every = int(draw.integers(3, 9))
        knots = np.arange(0, n, every)
        own, values, what = t[knots], z[knots], f"1 of {every}"
    else:
        own = np.arange(0.0, t[-1] + 1.0, t[1] * draw.uniform(3.2, 8.0))
        noise = flight.sigma * draw.standard_normal((len(own), 3))
        values, what = from_cartesian(flight.at(own)) + noise, f"every {own[1] / t[1]:.2f}"
    turns = np.unwrap(values[:, 1])
    values = np.stack([values[:, 0], turns, values[:, 2]], 1)
    for c in components:
        z[:, c] = np.interp(t, own, values[:, c])
    if seed % 3 == 0:
        z = np.stack([np.round(z[:, 0], 3), np.round(z[:, 1], 7), np.round(z[:, 2], 7)], 1)
    return _log(t, z, flight, f"{what} of {components}")


def one_sided(draw: Draw, seed: int) -> Faulty:
    """Errors on one side in half of the readings of a component, or some more: multipath, late echoes."""
    flight = fly(draw)
    z, n = flight.seen(), len(flight.time_s)
    c, share = (0, 0, 1, 2)[seed % 4], draw.uniform(0.45, 0.65)
    size, kind = draw.uniform(4, 14) * flight.sigma[c], seed // 2 % 4
    errors = draw.exponential(size, n), np.abs(size * draw.standard_normal(n)), draw.uniform(0, 2 * size, n)
    error = (*errors, np.full(n, size))[kind]
    z[:, c] += (draw.random(n) < share) * error * draw.choice([-1, 1])
    shape = ("exponential", "half normal", "uniform", "constant")[kind]
    return _log(flight.time_s, z, flight, f"{'rae'[c]} {100 * share:.0f} % {shape} {size / flight.sigma[c]:.1f} sigma")


#: Name -> one fault drawn for a flight, by a generator and a seed. The first two have none.
CLASSES: dict[str, Callable[[Draw, int], Faulty]] = {
    "clean": clean,
    "dirty": dirty,
    "step of 10 sigma": step(10.0),
    "step of 20 sigma": step(20.0),
    "step of 50 sigma": step(50.0),
    "step of 100 sigma": step(100.0),
    "several steps": steps,
    "range ambiguity": ambiguity,
    "another lobe": lobe,
    "clock jump": clock,
    "held": held,
    "resampled": resampled,
    "one-sided errors": one_sided,
}
SOUND = ("clean", "dirty")


def make(name: str, seed: int) -> Faulty:
    """The log of a class and a seed; the same bytes each time."""
    return CLASSES[name](np.random.default_rng([list(CLASSES).index(name), seed]), seed)
