"""Flights that are hard to follow, of all sizes: 0.2 to 1000 readings a second, 50 m to 2,000 km away, noise from a
millimetre to a hundred metres. Manoeuvring ones are drawn twice as often."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ftproc.records import FloatArray
from ftproc.simulation.flights.abrupt import ABRUPT
from ftproc.simulation.flights.aircraft import Airframe, fly
from ftproc.simulation.flights.kinds import AIRLINER, FIGHTER, FLIGHTS, HELICOPTER, LIGHT
from ftproc.simulation.flights.kinematics import GRAVITY_MPS2, Flight, heading, integrate, smoothed
from ftproc.simulation.instrument import PERFECT
from ftproc.simulation.scenarios import Plan
from ftproc.simulation.simulation import measure
from tests.drone import DRONE
from tests.trust.runs import Faulty

Draw = np.random.Generator
LEAD_S = 10.0  # that a motion is known beyond the log's ends, or a tenth of the log
EARTH_M, EARTH_M3PS2 = 6.371e6, 3.986e14


class Target(NamedTuple):
    """What is tracked, and by what. build: its flight for a duration s; rate_hz, lasts_s: of the log. sigma: of range
    m and angles rad, each drawn within a third up or down. manoeuvring: is drawn twice as often."""

    name: str
    build: Callable[[Draw, float], Flight]
    rate_hz: float
    lasts_s: float
    sigma: tuple[float, float]
    manoeuvring: bool = False


class Seen(NamedTuple):
    """A flight and the log to be made of it. sigma: (3,) m, rad, rad."""

    name: str
    flight: Flight
    lasts_s: float
    dt_s: float
    sigma: FloatArray


def _knots(lasts_s: float, step_s: float) -> tuple[float, FloatArray]:
    """The first knot and the (n,) times s of knots from before the log to after it."""
    lead = min(LEAD_S, 0.1 * lasts_s)
    return -lead, np.arange(-lead, lasts_s + lead, step_s)


def _away(draw: Draw, away_m: float, height_m: float) -> FloatArray:
    return draw.uniform(0.7, 1.4) * away_m * heading(draw) + np.array([0.0, 0.0, draw.uniform(0.7, 1.4) * height_m])


def _along(
    draw: Draw, acceleration: FloatArray, t: FloatArray, away_m: float, height_m: float, velocity: FloatArray
) -> Flight:
    """Given accelerations at knots, moved so that the middle lies at the distance and height."""
    flight = integrate(float(t[0]), float(t[1] - t[0]), acceleration, velocity, np.zeros(3))
    path = flight.position[np.searchsorted(t, 0.0) :]
    aim = _away(draw, away_m, height_m) - 0.5 * (path.min(0) + path.max(0))
    aim[2] = max(aim[2], 0.02 * away_m - path[:, 2].min())
    return flight.moved(aim)


def _kept_near(acceleration: FloatArray, step_s: float, time_s: float) -> FloatArray:
    """Accelerations whose change of velocity fades with a time s, so that the target does not run away."""
    keep, change = 1 - step_s / time_s, np.zeros(3)
    found = np.empty_like(acceleration)
    for k, a in enumerate(acceleration):
        found[k] = a - change / time_s
        change = keep * change + a * step_s
    return found


def singer(size: float, fade_s: float, speed: float, place: tuple[float, float], draw: Draw, lasts_s: float) -> Flight:
    """Acceleration that is Gauss-Markov noise of a size m/s2 and correlation time."""
    step = fade_s / 40
    _, t = _knots(lasts_s, step)
    noise = draw.standard_normal((len(t), 3)) * [1.0, 1.0, 0.5]
    keep = np.exp(-1 / 40)
    for k in range(1, len(t)):
        noise[k] = keep * noise[k - 1] + np.sqrt(1 - keep**2) * noise[k]
    return _along(draw, size * _kept_near(smoothed(noise, 9), step, 2 * fade_s), t, *place, speed * heading(draw))


def weave(size: float, period_s: float, speed: float, place: tuple[float, float], draw: Draw, lasts_s: float) -> Flight:
    """Swings to the side and up and down by accelerations of a size m/s2."""
    _, t = _knots(lasts_s, period_s / 100)
    along = heading(draw)
    side, phase = np.array([-along[1], along[0], 0.0]), draw.uniform(0, 2 * np.pi, 2)
    omega = 2 * np.pi / period_s
    up = np.array([0.0, 0.0, 1.0])
    swing = np.outer(np.sin(omega * t + phase[0]), side) + np.outer(np.sin(0.62 * omega * t + phase[1]), 0.5 * up)
    first = omega * t[0] * np.array([1.0, 0.62])
    start = -np.cos(phase + first) * size / omega * [1.0, 0.5 / 0.62]
    return _along(draw, size * swing, t, *place, speed * along + start[0] * side + start[1] * up)


def jinks(size: float, every_s: float, speed: float, place: tuple[float, float], draw: Draw, lasts_s: float) -> Flight:
    """Accelerations to any side, each held for a while and changed within a tenth of it."""
    step = every_s / 50
    _, t = _knots(lasts_s, step)
    sides = draw.standard_normal((int(len(t) / 30) + 2, 3)) * [1.0, 1.0, 0.5]
    lasts = draw.integers(25, 75, len(sides))
    held = np.repeat(sides, lasts, axis=0)[: len(t)]
    return _along(draw, size * _kept_near(smoothed(held, 5), step, 2 * every_s), t, *place, speed * heading(draw))


def loops(size: float, speed: float, place: tuple[float, float], draw: Draw, lasts_s: float) -> Flight:
    """Level flight and vertical circles in turn, entered within a second."""
    around = 2 * np.pi * speed / size
    _, t = _knots(lasts_s, around / 400)
    rate = np.zeros((len(t), 1))
    first, straight = draw.uniform(0.1, 0.4) * around, draw.uniform(0.4, 1.5) * around
    looping = ((t - t[0] - first) % (around + straight)) < around
    rate[looping] = 2 * np.pi / around
    rate = smoothed(rate, 33)[:, 0]
    pitch = np.cumsum(rate) * (t[1] - t[0])
    along = heading(draw)
    normal = -np.outer(np.sin(pitch), along) + np.outer(np.cos(pitch), [0, 0, 1])
    return _along(draw, speed * rate[:, None] * normal, t, *place, speed * along)


def circles(radius: float, speed: float, place: tuple[float, float], draw: Draw, lasts_s: float) -> Flight:
    """Steady circles."""
    omega = speed / radius * draw.choice([-1, 1])
    _, t = _knots(lasts_s, 2 * np.pi / abs(omega) / 400)
    turn = omega * t + draw.uniform(0, 6)
    inward = -np.stack([np.cos(turn), np.sin(turn), 0 * turn], 1)
    start = omega * radius * np.array([-np.sin(turn[0]), np.cos(turn[0]), 0.0])
    return _along(draw, omega**2 * radius * inward, t, *place, start)


def lobbed(speed: float, rise: float, terminal: float, away_m: float, draw: Draw, lasts_s: float) -> Flight:
    """A shell under gravity and drag that fades with the height; terminal: its speed of fall m/s at the ground. Lifted
    where it would fall below the station."""
    step = lasts_s / 4000
    begin, t = _knots(lasts_s, step)
    p, v = _away(draw, away_m, 0.002 * away_m + 5), speed * heading(draw, rise)
    start, velocity, a = p.copy(), v.copy(), np.empty((len(t), 3))
    for k in range(len(t)):
        thin = GRAVITY_MPS2 / terminal**2 * np.exp(-max(p[2], 0.0) / 8000)
        a[k] = [0, 0, -GRAVITY_MPS2] - thin * np.sqrt(v @ v) * v
        p, v = p + step * (v + step / 2 * a[k]), v + step * a[k]
    flight = integrate(begin, step, a, velocity, start)
    return flight.moved(np.array([0.0, 0.0, max(0.0, 5.0 - flight.position[:, 2].min())]))


def orbital(height_m: float, off: float, draw: Draw, lasts_s: float) -> Flight:
    """A circular orbit that passes the station `off` rad of the earth's circumference aside."""
    radius = EARTH_M + height_m
    omega = np.sqrt(EARTH_M3PS2 / radius**3)
    begin, t = _knots(lasts_s, max(lasts_s / 5000, 0.01))
    across, turn = draw.choice([-1, 1]) * off, omega * (t - lasts_s / 2)
    along = heading(draw)
    side = np.array([-along[1], along[0], 0.0])
    up = np.array([0.0, 0.0, np.cos(across)]) + np.sin(across) * side
    centre = radius * (np.outer(np.cos(turn), up) + np.outer(np.sin(turn), along))
    velocity = omega * radius * (np.cos(turn[0]) * along - np.sin(turn[0]) * up)
    return integrate(begin, t[1] - t[0], -(omega**2) * centre, velocity, centre[0] - np.array([0.0, 0.0, EARTH_M]))


def flown(airframe: Airframe, place: tuple[float, float], draw: Draw, lasts_s: float) -> Flight:
    """A pilot's manoeuvres at a distance and height m."""
    found = fly(airframe, lasts_s, draw)
    low = found.at(np.linspace(0, lasts_s, 2000))[0][:, 2].min()
    return found.moved(_away(draw, place[0], 0.0) + np.array([0.0, 0.0, place[1] - low]))


SWIFT = replace(FIGHTER, step_s=0.02, onset_s=(0.3, 0.8), turn_g=(3.0, 8.0), leg_s=(1, 5))
RACER = replace(DRONE, step_s=0.02, speed_mps=(8, 30), turn_g=(1.5, 4.0), pull_g=(0.5, 2.0), onset_s=(0.15, 0.4))
SHIP = replace(
    LIGHT, speed_mps=(4, 12), turn_g=(1.002, 1.01), climb_rad=(1e-6, 2e-6), pull_g=(1e-4, 2e-4), height_m=(0, 1),
    gust_mps2=0.4, leg_s=(20, 60), thrust_mps2=(0.02, 0.1),
)  # fmt: skip
TARGETS = (
    Target("singer of 5 m/s2", partial(singer, 5, 8, 150, (6e3, 2e3)), 10, 150, (3, 2e-4), True),
    Target("singer of 40 m/s2", partial(singer, 40, 3, 250, (8e3, 3e3)), 50, 50, (2, 1e-4), True),
    Target("singer, coarse radar", partial(singer, 15, 10, 200, (4e4, 8e3)), 1, 600, (30, 1e-3), True),
    Target("singer, slow radar", partial(singer, 2, 40, 220, (1.5e5, 1e4)), 0.2, 4000, (50, 1.5e-3), True),
    Target("singer, laser", partial(singer, 3, 2, 15, (400, 60)), 20, 80, (0.005, 2e-5), True),
    Target("weave of 3 g", partial(weave, 30, 12, 220, (5e3, 1500)), 20, 120, (2, 2e-4), True),
    Target("weave, sea-skimmer", partial(weave, 80, 4, 300, (6e3, 30)), 100, 25, (1, 3e-4), True),
    Target("weave, walker", partial(weave, 0.8, 3, 1.5, (60, 3)), 10, 180, (0.003, 5e-5), True),
    Target("weave, car", partial(weave, 4, 9, 25, (500, 5)), 5, 200, (0.02, 5e-5), True),
    Target("jinks of 6 g", partial(jinks, 60, 3, 280, (7e3, 2500)), 50, 60, (3, 1.5e-4), True),
    Target("jinks, rough radar", partial(jinks, 20, 8, 240, (2.5e4, 5e3)), 4, 300, (15, 8e-4), True),
    Target("jinks, 1000 Hz", partial(jinks, 200, 0.5, 120, (900, 300)), 1000, 5, (0.05, 3e-5), True),
    Target("jinks, quadcopter", partial(jinks, 6, 1.5, 8, (150, 40)), 25, 80, (0.01, 4e-5), True),
    Target("loops", partial(loops, 30, 110, (3e3, 1200)), 25, 90, (1, 1e-4), True),
    Target("loops of a model", partial(loops, 25, 25, (250, 60)), 50, 40, (0.02, 5e-5), True),
    Target("fighter of 8 g", partial(flown, SWIFT, (9e3, 2e3)), 50, 70, (3, 1e-4), True),
    Target("fighter, weapon radar", partial(flown, FIGHTER, (1.5e4, 3e3)), 10, 200, (8, 6e-4), True),
    Target("fighter, 2 Hz", partial(flown, FIGHTER, (3e4, 3e3)), 2, 400, (20, 1e-3), True),
    Target("fighter, 200 Hz", FLIGHTS["fighter"], 200, 20, (0.5, 5e-5), True),
    Target("light aircraft, 5 Hz", partial(flown, LIGHT, (5e3, 600)), 5, 300, (2, 2e-4), True),
    Target("light aircraft, noise of 100 m", partial(flown, LIGHT, (3e4, 1e3)), 1, 900, (100, 3e-3), True),
    Target("helicopter", partial(flown, HELICOPTER, (2e3, 200)), 10, 200, (1, 2e-4), True),
    Target("drone, total station", partial(flown, DRONE, (250, 30)), 5, 200, (0.003, 2e-5), True),
    Target("drone that races", partial(flown, RACER, (120, 15)), 50, 50, (0.02, 1e-4), True),
    Target("drone, radar", partial(flown, DRONE, (1500, 60)), 8, 200, (1.5, 2e-3), True),
    Target("circles of calibration", partial(circles, 4e3, 90, (800, 1500)), 10, 250, (3, 2e-4)),
    Target("circles, tight", partial(circles, 40, 18, (300, 80)), 20, 90, (0.01, 3e-5), True),
    Target("circles at 50 m", partial(circles, 12, 3, (50, 6)), 20, 100, (0.002, 5e-5)),
    Target("airliner", partial(flown, AIRLINER, (8e4, 9e3)), 1, 1200, (25, 1e-3)),
    Target("airliner, 0.25 Hz", partial(flown, AIRLINER, (2e5, 1e4)), 0.25, 4000, (60, 1.2e-3)),
    Target("airliner, laser", partial(flown, AIRLINER, (3e4, 9e3)), 20, 150, (0.5, 1e-5)),
    Target("cruiser", FLIGHTS["cruiser"], 10, 250, (3, 2e-4)),
    Target("overhead pass", FLIGHTS["overhead"], 20, 120, (3, 2e-4)),
    Target("rocket", FLIGHTS["rocket"], 20, 120, (8, 2e-4)),
    Target("ship in a seaway", partial(flown, SHIP, (4e3, 5)), 2, 900, (3, 2e-4)),
    Target("mortar shell", partial(lobbed, 220, 1.0, 280, 1500), 100, 30, (1, 2e-4)),
    Target("artillery shell", partial(lobbed, 800, 0.8, 380, 1e4), 20, 70, (5, 3e-4)),
    Target("bullet, 1000 Hz", partial(lobbed, 900, 0.05, 120, 120), 1000, 3, (0.05, 2e-4)),
    Target("long-range rocket", partial(lobbed, 2800, 0.8, 900, 3e4), 5, 400, (20, 2e-4)),
    Target("satellite at 400 km", partial(orbital, 4e5, 0.05), 5, 400, (2, 3e-5)),
    Target("satellite at 1,200 km", partial(orbital, 1.2e6, 0.1), 1, 700, (0.02, 1e-5)),
    Target("satellite, radar", partial(orbital, 8e5, 0.15), 0.5, 700, (100, 8e-4)),
)
ABRUPT_INSTRUMENTS = ((100, 30, (0.5, 1e-4)), (25, 60, (2, 2e-4)), (10, 90, (5, 4e-4)), (50, 40, (0.05, 3e-5)))


def _sigma(draw: Draw, sigma: tuple[float, float]) -> FloatArray:
    return np.array([sigma[0], sigma[1], sigma[1]]) * np.exp(draw.uniform(-0.3, 0.3, 3))


def _order() -> list[Target]:
    drawn = [target for target in TARGETS for _ in range(1 + target.manoeuvring)]
    return [drawn[k] for k in np.random.default_rng(8).permutation(len(drawn))]


ORDER = _order()


def take(number: int, draw: Draw) -> Seen:
    """The target of a number, each of ORDER in turn, on a flight that is drawn."""
    target = ORDER[number % len(ORDER)]
    flight = target.build(draw, target.lasts_s)
    return Seen(target.name, flight, target.lasts_s, 1 / target.rate_hz, _sigma(draw, target.sigma))


def take_abrupt(number: int, draw: Draw) -> Seen:
    """One of the motions that change at once, seen by one of some instruments."""
    name = list(ABRUPT)[number % len(ABRUPT)]
    rate_hz, lasts_s, sigma = ABRUPT_INSTRUMENTS[(number // len(ABRUPT) + number) % len(ABRUPT_INSTRUMENTS)]
    return Seen(name, ABRUPT[name](draw, lasts_s), lasts_s, 1 / rate_hz, _sigma(draw, sigma))


def log(seen: Seen, outliers: str, name: str, seed: list[int]) -> Faulty:
    """What is read of a flight, with the faults of a specification."""
    sigma = (float(seen.sigma[0]), float(seen.sigma[1]), float(seen.sigma[2]))
    plan = Plan("", seen.lasts_s, seen.dt_s, sigma, outliers, PERFECT)
    return Faulty(measure(seen.flight, plan, seen.sigma, name, seed), f"{seen.name}, {outliers}")


def with_gaps(number: int) -> Faulty:
    """The log of a flight without another fault than three gaps of at least four samples, up to a thirteenth of it."""
    seen, seed = take(number, np.random.default_rng([99, number])), [99, number]
    shortest_s, longest_s = max(4 * seen.dt_s, seen.lasts_s / 40), seen.lasts_s / 13
    return log(seen, f"gap=3:{shortest_s:.4g}-{longest_s:.4g}", f"gaps {number}", seed)
