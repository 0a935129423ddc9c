"""Aircraft that fly by the forces of the air: lift that follows the stick late, induced drag, thrust, a bank that takes
time, side-slip, and gusts that the wing feels until the aircraft has turned into them. A pilot follows a path with what
these forces give, so that speed, load and bank are never quite those that were meant."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ftproc.records import FloatArray
from ftproc.simulation.flights.air import LEAST_SPEED_MPS, Air, by_mach, density, sound_mps
from ftproc.simulation.flights.kinematics import DOWN_MPS2, Flight, Force

AIR_STEP_S = 0.02
FOLLOWS_RADPS, DAMPED = 0.3, 0.8  # of the pilot, back to the path
GROWS_S = 0.1  # in which a wing's lift has grown to what a gust gives (Kuessner)
SLIPS_S, SETTLES_S = (3.0, 15.0), 1.0  # how long a side-slip is held, and how fast it comes and goes

Range = tuple[float, float]


@dataclass(frozen=True)
class Craft:
    """An aircraft; every pair is the range that values are drawn from.

    loading_kgpm2: mass over wing area. lift_slope, side_slope: of the coefficients by angle of attack and side-slip,
    1/rad. drag, induced: of the drag coefficient drag + induced lift^2. most_lift: coefficient. thrust_mps2: what there
    is, negative for a brake. pitch_s, roll_s, throttle_s: how late lift, bank and thrust follow. wind_mps: at 1000 m.
    gust_mps: RMS. slip_rad: of a side-slip that is held.
    """

    loading_kgpm2: Range
    lift_slope: float
    drag: float
    induced: float
    most_lift: float
    thrust_mps2: Range
    pitch_s: Range
    roll_s: Range
    throttle_s: float
    wind_mps: Range
    gust_mps: Range
    slip_rad: Range = (0.02, 0.12)
    side_slope: float = 0.7


AERO_FIGHTER = Craft(
    loading_kgpm2=(330, 450), lift_slope=3.8, drag=0.02, induced=0.13, most_lift=1.3, thrust_mps2=(-3.0, 12.0),
    pitch_s=(0.25, 0.5), roll_s=(0.3, 0.7), throttle_s=1.5, wind_mps=(2, 15), gust_mps=(0.2, 1.5),
)  # fmt: skip
AERO_LIGHT = Craft(
    loading_kgpm2=(60, 95), lift_slope=5.0, drag=0.03, induced=0.055, most_lift=1.4, thrust_mps2=(-1.0, 3.5),
    pitch_s=(0.3, 0.6), roll_s=(0.6, 1.2), throttle_s=1.0, wind_mps=(2, 10), gust_mps=(0.2, 1.0),
)  # fmt: skip
AERO_AIRLINER = Craft(
    loading_kgpm2=(500, 620), lift_slope=5.5, drag=0.02, induced=0.045, most_lift=1.2, thrust_mps2=(-1.0, 2.5),
    pitch_s=(0.6, 1.0), roll_s=(1.5, 2.5), throttle_s=4.0, wind_mps=(3, 20), gust_mps=(0.2, 1.0), slip_rad=(0.0, 0.01),
)  # fmt: skip


def aerodynamic(craft: Craft, path: Flight, slips: bool, rng: np.random.Generator) -> Force:
    """The force on an aircraft whose pilot follows a path, step by step. slips: whether it slips sideways at times."""
    air = Air(rng, rng.uniform(*craft.wind_mps), rng.uniform(*craft.gust_mps))
    return _Flown(craft, path, air, _slips(craft, path, rng) if slips else None, rng).force


def _slips(craft: Craft, path: Flight, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Times s at which another side-slip rad is commanded, half of them none."""
    span = path.step_s * len(path.acceleration)
    lasts = rng.uniform(*SLIPS_S, max(2, math.ceil(2 * span / sum(SLIPS_S)) + 1))
    angle = rng.uniform(*craft.slip_rad, len(lasts)) * rng.choice([-1.0, 0.0, 0.0, 1.0], len(lasts))
    return path.start_s + np.cumsum(lasts) - lasts[0], angle


class _Flown:
    """An aircraft in the air, one step after the other."""

    def __init__(
        self,
        craft: Craft,
        path: Flight,
        air: Air,
        slips: tuple[FloatArray, FloatArray] | None,
        rng: np.random.Generator,
    ) -> None:
        self.craft, self.path, self.air, self.slips = craft, path, air, slips
        self.loading = rng.uniform(*craft.loading_kgpm2)
        self.pitch_s, self.roll_s = rng.uniform(*craft.pitch_s), rng.uniform(*craft.roll_s)
        self.time_s = self.step_s = math.inf  # of the last step, and since then: in the first one all is as meant
        self.lift = self.thrust = self.slip = 0.0
        self.up, self.turned, self.felt = np.array([0.0, 0.0, 1.0]), np.zeros(3), np.zeros(3)

    def force(self, t: float, p: FloatArray, v: FloatArray) -> FloatArray:
        """(3,) m/s2 at a time s, position m and velocity m/s."""
        craft, height = self.craft, float(p[2])
        self.step_s, self.time_s = math.inf if math.isinf(self.time_s) else t - self.time_s, t
        gust = self.air.further((AIR_STEP_S if math.isinf(self.step_s) else self.step_s) * math.sqrt(float(v @ v)))
        through = v - self.air.wind(height) - gust
        speed = max(math.sqrt(float(through @ through)), LEAST_SPEED_MPS)
        ahead, pressure = through / speed, 0.5 * density(height) * speed * speed / self.loading
        wanted = self._wanted(t, p, v)
        self._bank(wanted, ahead)
        lift = float(np.clip(wanted @ self.up / pressure, -craft.most_lift, craft.most_lift))
        self.lift += self._part(self.pitch_s) * (lift - self.lift)
        self.turned += self._part(self.pitch_s) * (gust - self.turned)
        self.felt += self._part(GROWS_S) * (gust - self.turned - self.felt)
        coefficient = self.lift + craft.lift_slope * float(self.felt @ self.up) / speed
        side = np.cross(ahead, self.up)
        slip = self._slip(t) + float(self.felt @ side) / speed
        drag = pressure * (craft.drag * by_mach(speed / sound_mps(height), 1.0) + craft.induced * coefficient**2)
        thrust = float(np.clip(wanted @ ahead + drag, *craft.thrust_mps2))
        self.thrust += self._part(craft.throttle_s) * (thrust - self.thrust)
        by_air = coefficient * self.up + craft.side_slope * slip * side
        return np.asarray(DOWN_MPS2 + pressure * by_air + (self.thrust - drag) * ahead)

    def _part(self, late_s: float) -> float:
        """Of a change, in a step."""
        return min(self.step_s / late_s, 1.0)

    def _wanted(self, t: float, p: FloatArray, v: FloatArray) -> FloatArray:
        """(3,) specific force m/s2 that would lead back to the path."""
        place, velocity, acceleration = (each[0] for each in self.path.at(np.array([t])))
        back = FOLLOWS_RADPS**2 * (place - p) + 2 * DAMPED * FOLLOWS_RADPS * (velocity - v)
        return np.asarray(acceleration + back - DOWN_MPS2)

    def _bank(self, wanted: FloatArray, ahead: FloatArray) -> None:
        """Turn the lift towards what of a force is across the way."""
        across = wanted - wanted @ ahead * ahead
        size = math.sqrt(float(across @ across))
        if size > 0:
            self.up = self.up + self._part(self.roll_s) * (across / size - self.up)
        up = self.up - self.up @ ahead * ahead
        self.up = up / max(math.sqrt(float(up @ up)), 1e-9)

    def _slip(self, t: float) -> float:
        if self.slips is not None:
            times, angles = self.slips
            angle = float(angles[max(int(np.searchsorted(times, t, "right")) - 1, 0)])
            self.slip += self._part(SETTLES_S) * (angle - self.slip)
        return self.slip


#: Name -> what flies; the path of each is that of the point mass of the same use.
CRAFTS: dict[str, Craft] = {"fighter": AERO_FIGHTER, "light": AERO_LIGHT, "airliner": AERO_AIRLINER}
