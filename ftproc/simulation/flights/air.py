"""The air that a flight meets: its density, the speed of sound, wind that grows with height, gusts; and what of a
body's drag depends on the Mach number."""

from __future__ import annotations

import math

import numpy as np

from ftproc.records import FloatArray
from ftproc.simulation.flights.kinematics import heading

TROPOPAUSE_M = 11_000.0
LEAST_SPEED_MPS = 1.0  # through the air, below which it has no direction


def density(height_m: float) -> float:
    """kg/m3, of the standard atmosphere (ISO 2533), isothermal above the tropopause."""
    low = min(height_m, TROPOPAUSE_M)
    return 1.225 * math.pow(1 - 2.25577e-5 * low, 4.25588) * math.exp(-max(height_m - TROPOPAUSE_M, 0.0) / 6341.6)


def sound_mps(height_m: float) -> float:
    """The speed of sound in the same atmosphere."""
    return 20.0468 * math.sqrt(288.15 - 0.0065 * min(height_m, TROPOPAUSE_M))


class Air:
    """Wind of one flight, that grows with height and turns with it, and gusts along the path.

    Gusts are a Gauss-Markov process along the way through the air, the exponential correlation of Dryden's longitudinal
    spectrum (MIL-F-8785C), on all axes.
    """

    def __init__(self, rng: np.random.Generator, wind_mps: float, gust_mps: float, length_m: float = 300.0) -> None:
        """wind_mps: at 1000 m. gust_mps: RMS of an axis. length_m: of their correlation."""
        self.rng, self.gust_mps, self.length_m = rng, gust_mps, length_m
        self.first, self.second = wind_mps * heading(rng), wind_mps * rng.uniform(-0.3, 0.3) * heading(rng)
        self.gust = gust_mps * rng.standard_normal(3)

    def wind(self, height_m: float) -> FloatArray:
        """(3,) m/s without gusts."""
        above = max(height_m, 10.0) / 1000.0
        return np.asarray(self.first * above**0.3 + self.second * math.log(above))

    def further(self, way_m: float) -> FloatArray:
        """(3,) m/s of the gusts after so much of a way through the air."""
        kept = math.exp(-way_m / self.length_m)
        self.gust = kept * self.gust + math.sqrt(1 - kept * kept) * self.gust_mps * self.rng.standard_normal(3)
        return self.gust


def by_mach(mach: float, rise: float) -> float:
    """What multiplies a blunt body's drag coefficient: 1 far below the speed of sound, 1 + rise soon above it, and
    slowly less from there on."""
    return 1 + rise / (1 + math.exp(min((0.98 - mach) / 0.035, 500.0))) / math.pow(max(mach, 1.0), 0.7)
