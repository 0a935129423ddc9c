"""What a log says of its own scales: its interval, its noise in metres, and the memory of a filter over it.

A track with jerk density q, seen with noise sigma every T seconds, is averaged by its filter over about
(sigma^2 T / q)^(1/6) seconds. That time, the filter's memory, is the yardstick of everything that depends on how fast
the target moves; so a flight and its copy in other units of length and time give the same result in these units.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.records import Observations
from ftproc.order_statistics import SOME, median, medians

FloatArray = NDArray[np.float64]

SHORTEST_S = 1e-30  # of an interval: no clock is finer, and its sixth power is still a number
FINEST = 1e-9  # of the range: no noise is smaller
EXACT = 1e-4  # of the noisiest component's noise, in metres: one that shows less was not measured


class Scales(NamedTuple):
    """interval_s: typical. span_s: of the whole log. range_m: typical. noise_m: (3,) 1-sigma of the components along
    and across the line of sight."""

    interval_s: float
    span_s: float
    range_m: float
    noise_m: FloatArray

    @property
    def exact(self) -> NDArray[np.bool_]:
        """(3,) which components show no noise, beside the noisiest."""
        return np.asarray(self.noise_m < EXACT * self.noise_m.max(), np.bool_)

    @property
    def typical_noise_m(self) -> float:
        """The median of the noise of the components that show some."""
        return median(self.noise_m[~self.exact])

    def memory_s(self, jerk_psd: float) -> float:
        """The memory of a filter for this jerk density, m^2/s^5."""
        return float((self.typical_noise_m**2 * self.interval_s / max(jerk_psd, 1e-300)) ** (1 / 6))

    def memory_samples(self, jerk_psd: float) -> float:
        """The same in typical intervals."""
        return self.memory_s(jerk_psd) / self.interval_s

    def jerk_psd(self, memory_s: float) -> float:
        """The jerk density, m^2/s^5, that gives a filter this memory."""
        return float(self.typical_noise_m**2 * self.interval_s / memory_s**6)


def scales_of(log: Observations, noise_variance: FloatArray) -> Scales:
    """The scales of a log with this noise (3,) m^2, rad^2, rad^2."""
    every = 1 + len(log.time_s) // SOME
    ranges = log.measurement[::every, 0][log.weight[::every, 0] > 0]
    ranges = ranges[np.isfinite(ranges)]
    range_m = median(ranges) if len(ranges) else 1.0
    times = log.time_s[1::every] - log.time_s[:-1:every]
    times = times[times > 0]
    interval = max(median(times), SHORTEST_S) if len(times) else 1.0
    if log.sites is not None:
        return Scales(interval, max(float(log.time_s[-1] - log.time_s[0]), interval), *_of_sites(log, noise_variance))
    if log.uneven is not None:
        noise_variance = medians(noise_variance * log.uneven.times + log.uneven.late**2)
    noise = np.maximum(np.sqrt(noise_variance) * np.array([1.0, range_m, range_m]), FINEST * range_m)
    return Scales(interval, max(float(log.time_s[-1] - log.time_s[0]), interval), range_m, noise)


def _of_sites(log: Observations, noise_variance: FloatArray) -> tuple[float, FloatArray]:
    """Typical range, and the noise in m of each component of a station that is used, of several stations."""
    assert log.sites is not None
    station, range_m = log.sites.station, log.sites.range_m
    used = np.stack([np.bincount(station, log.weight[:, c] > 0, len(range_m)) for c in range(3)], 1) > 0
    typical = median(range_m)
    noise = np.sqrt(noise_variance) * np.stack([np.ones_like(range_m), range_m, range_m], 1)
    return typical, np.maximum(noise[used], FINEST * typical)
