"""Point-mass aircraft flown through a random sequence of legs, turns, climbs and speed changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ftproc.core.model.frames import from_cartesian
from ftproc.records import FloatArray
from ftproc.simulation.flights.kinematics import GRAVITY_MPS2, Flight, gusts, integrate, smoothed

Range = tuple[float, float]

GROUND_M = 30.0  # lowest height above the station's horizontal plane
PUSH_G = 0.6  # largest decrease from 1 g when pushing over: the load factor stays positive


@dataclass(frozen=True)
class Airframe:
    """Performance of an aircraft and its use; every pair is the range that values are drawn from.

    turn_g: load factor of level turns. pull_g: normal acceleration beyond 1 g on entering and leaving climbs. onset_s:
    time to roll in or to build up g. area_m: horizontal distance of the working area's centre from the station.
    radius_m: distance from that centre at which the pilot turns back. closest_m: smallest slant range. steepest_rad:
    largest elevation. weights: probabilities of the manoeuvres.
    """

    speed_mps: Range
    turn_g: Range
    turn_rad: Range
    climb_rad: Range
    pull_g: Range
    thrust_mps2: Range
    onset_s: Range
    leg_s: Range
    height_m: Range
    area_m: Range
    radius_m: float
    gust_mps2: float
    step_s: float
    closest_m: float = 800.0
    steepest_rad: float = 1.25
    weights: tuple[float, float, float, float] = (0.25, 0.4, 0.2, 0.15)  # leg, turn, climb, speed change


def fly(airframe: Airframe, duration_s: float, rng: np.random.Generator) -> Flight:
    """A flight from before time 0 to `duration_s`, about the origin of the working area.

    Time 0 is anywhere in the sequence of manoeuvres, not only on a straight leg.
    """
    lead = rng.uniform(0.5, 2.0) * airframe.leg_s[1]
    pilot = _Pilot(airframe, rng)
    pilot.leg()  # straight, so that the first command is at rest
    while pilot.elapsed_s < lead + duration_s + 2 * airframe.onset_s[1]:
        pilot.decide()
    return follow(pilot.commands, pilot.initial, airframe, lead, rng)


def follow(
    commands: list[tuple[int, float, float, float]],
    initial: tuple[float, float, FloatArray],
    airframe: Airframe,
    lead_s: float,
    rng: np.random.Generator,
) -> Flight:
    """Fly commands from an initial speed m/s, heading rad and (3,) position m.

    commands: knots, then change of speed m/s, climb angle rad and heading rad. The record's time 0 is
    `lead_s` after the first knot. Heading runs from x towards y.
    """
    step = airframe.step_s
    counts = np.array([knots for knots, *_ in commands])
    rates = np.array([change for _, *change in commands]) / (counts * step)[:, None]
    rate = smoothed(np.repeat(rates, counts, axis=0), max(3, round(rng.uniform(*airframe.onset_s) / step)))
    total = np.vstack([np.zeros(3), np.cumsum(step * (rate[1:] + rate[:-1]) / 2, axis=0)])
    speed, climb, heading = (total + np.array([initial[0], 0.0, initial[1]])).T
    gust, gust_velocity = gusts(len(rate), step, airframe.gust_mps2, rng)
    acceleration = path_acceleration(speed, climb, heading, rate) + gust
    velocity = initial[0] * np.array([np.cos(initial[1]), np.sin(initial[1]), 0.0])
    return integrate(-lead_s, step, acceleration, velocity + gust_velocity, initial[2])


def placed(flight: Flight, airframe: Airframe, duration_s: float, away_m: float, bearing: float) -> Flight:
    """Place the area's centre at a distance and bearing, farther away while the flight is too close or too steep."""
    path = flight.at(np.linspace(0.0, duration_s, max(2000, round(2 * duration_s))))[0]
    lift = max(0.0, GROUND_M - float(path[:, 2].min()))
    while True:
        shift = np.array([away_m * np.cos(bearing), away_m * np.sin(bearing), lift])
        slant, _, elevation = from_cartesian(path + shift).T
        if slant.min() >= airframe.closest_m and elevation.max() <= airframe.steepest_rad:
            return flight.moved(shift)
        away_m *= 1.15


def path_acceleration(speed: FloatArray, climb: FloatArray, heading: FloatArray, rate: FloatArray) -> FloatArray:
    """(n, 3) m/s2 from (n,) speed m/s, climb angle and heading rad, and their (n, 3) rates per second.

    The derivative of V (cos g cos h, cos g sin h, sin g): along the path V', in its plane V g', sideways V
    cos g h'.
    """
    cg, sg, ch, sh = np.cos(climb), np.sin(climb), np.cos(heading), np.sin(heading)
    along, normal, side = rate[:, 0], speed * rate[:, 1], speed * cg * rate[:, 2]
    return np.stack(
        [
            along * cg * ch - normal * sg * ch - side * sh,
            along * cg * sh - normal * sg * sh + side * ch,
            along * sg + normal * cg,
        ],
        axis=1,
    )


class _Pilot:
    """Draws the commands; dead reckoning keeps the aircraft within its area, speeds and heights."""

    def __init__(self, airframe: Airframe, rng: np.random.Generator) -> None:
        self.airframe, self.rng = airframe, rng
        self.speed = rng.uniform(*airframe.speed_mps)
        self.heading = rng.uniform(-np.pi, np.pi)
        around, off = rng.uniform(-np.pi, np.pi), airframe.radius_m * rng.uniform(0.0, 0.6)
        self.position = np.array([off * np.cos(around), off * np.sin(around), rng.uniform(*airframe.height_m)])
        self.initial = (self.speed, self.heading, self.position.copy())
        self.commands: list[tuple[int, float, float, float]] = []
        self.elapsed_s = 0.0

    def decide(self) -> None:
        """Command a manoeuvre: homewards when outside the area and leaving it, else by the airframe's weights."""
        if np.hypot(*self.position[:2]) > self.airframe.radius_m and abs(self._off_home()) > 1.0:
            self.turn(homewards=True)
            return
        choice = self.rng.choice(4, p=self.airframe.weights)
        (self.leg, self.turn, self.climb, self.change_speed)[choice]()

    def leg(self) -> None:
        self._command(self.rng.uniform(*self.airframe.leg_s))

    def turn(self, homewards: bool = False) -> None:
        """Level turn at a load factor n: sideways acceleration g sqrt(n^2 - 1)."""
        angle = self.rng.uniform(*self.airframe.turn_rad) * self.rng.choice([-1.0, 1.0])
        if homewards:
            angle = self._off_home() + self.rng.normal(0.0, 0.2)
        load = self.rng.uniform(*self.airframe.turn_g)
        parts = int(self.rng.integers(1, 4))  # tightened and eased on the way round
        for _ in range(parts):
            held = np.clip(load * self.rng.uniform(0.8, 1.2), *self.airframe.turn_g)
            side = GRAVITY_MPS2 * np.sqrt(held**2 - 1.0)
            self._command(abs(angle) / parts * self.speed / side, heading=angle / parts)

    def climb(self) -> None:
        """Pull up or push over, hold the slope, level off; back into the height band when outside it."""
        frame = self.airframe
        angle = self.rng.uniform(*frame.climb_rad) * self.rng.choice([-1.0, 1.0])
        low, high = frame.height_m
        if not low < self.position[2] < high:
            angle = abs(angle) if self.position[2] <= low else -abs(angle)
        room = high - self.position[2] if angle > 0 else self.position[2] - low
        pull = GRAVITY_MPS2 * self.rng.uniform(*frame.pull_g)
        push = min(pull, PUSH_G * GRAVITY_MPS2)
        enter, leave = (abs(angle) * self.speed / a for a in ((pull, push) if angle > 0 else (push, pull)))
        sink = self.speed * abs(np.sin(angle))
        hold = min(self.rng.uniform(*frame.leg_s), max(room / sink - (enter + leave) / 2, 0.0))
        self._command(enter, climb=angle)
        self._command(hold, climb_angle=angle)
        self._command(leave, climb=-angle, climb_angle=angle)

    def change_speed(self) -> None:
        change = self.rng.uniform(*self.airframe.speed_mps) - self.speed
        self._command(abs(change) / self.rng.uniform(*self.airframe.thrust_mps2), speed=change)

    def _off_home(self) -> float:
        """Angle in rad from the heading to the centre of the area."""
        home = np.arctan2(-self.position[1], -self.position[0])
        return float(np.mod(home - self.heading + np.pi, 2 * np.pi) - np.pi)

    def _command(
        self, time_s: float, speed: float = 0.0, climb: float = 0.0, heading: float = 0.0, climb_angle: float = 0.0
    ) -> None:
        """Append one command; dead reckoning with mean speed, mean climb angle, and an arc for a turn."""
        knots = max(1, round(time_s / self.airframe.step_s))
        seconds = knots * self.airframe.step_s
        self.commands.append((knots, speed, climb, heading))
        self.elapsed_s += seconds
        length = (self.speed + speed / 2) * seconds
        chord, middle = length * np.sinc(heading / (2 * np.pi)), self.heading + heading / 2
        slope = climb_angle + climb / 2
        self.position += [chord * np.cos(middle), chord * np.sin(middle), length * np.sin(slope)]
        self.speed += speed
        self.heading += heading
