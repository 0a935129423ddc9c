"""What a filter is given and what it leaves behind."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Start(NamedTuple):
    """Where a recursion begins: state (9,) and covariance (9, 9) before the update of `sample`."""

    sample: int
    state: FloatArray
    covariance: FloatArray


class Model(NamedTuple):
    """What the filter is told of noise and motion.

    noise_variance: (3,) m^2, rad^2, rad^2. jerk: (m, 6) tensor of the jerk density, m^2/s^5, each row holding for
    `knot_s` seconds from the first sample on. correlation: (3,) of the noise between neighbouring samples; where it is
    not zero, noise_variance is the larger variance of white noise that has the same effect (see
    `identification.coloured_noise`).
    """

    noise_variance: FloatArray
    jerk: FloatArray
    knot_s: float = math.inf
    correlation: FloatArray = np.zeros(3)

    @property
    def reading_variance(self) -> FloatArray:
        """(3,) variance of the noise of a single reading."""
        variance: FloatArray = self.noise_variance * (1 - self.correlation) / (1 + self.correlation)
        return variance


class FilterRun(NamedTuple):
    """What a recursive filter leaves behind, row for row with the log.

    state, predicted: (n, 9) after and before the update, SI units. sigma: (n, 9) 1-sigma after the update.
    innovation: (n, 3) m, rad, rad, NaN where missing. innovation_sigma: (n, 3) square root of the diagonal of S.
    weight: (n, 3) in [0, 1], zero where rejected or missing. nis: (n,) of the components used, NaN where none.
    los_sigma: (n, 6) 1-sigma of position and velocity along the radial, cross and up axes.
    since_start: (n,) samples since the last start. log_likelihood: of the innovations used.
    """

    time_s: FloatArray
    state: FloatArray
    predicted: FloatArray
    sigma: FloatArray
    innovation: FloatArray
    innovation_sigma: FloatArray
    weight: FloatArray
    nis: FloatArray
    los_sigma: FloatArray
    since_start: IntArray
    log_likelihood: float

    def rows(self, low: int, high: int) -> FilterRun:
        """Of the samples [low, high) alone; the likelihood stays that of the whole run."""
        return FilterRun._make([*(each[low:high] for each in self[:-1]), self.log_likelihood])


def empty_run(time_s: FloatArray) -> FilterRun:
    """A run of the right shapes for the kernels to fill."""
    n = len(time_s)
    return FilterRun(
        time_s, np.empty((n, 9)), np.empty((n, 9)), np.empty((n, 9)), np.empty((n, 3)), np.empty((n, 3)),
        np.zeros((n, 3)), np.full(n, np.nan), np.empty((n, 6)), np.zeros(n, np.int64), 0.0,
    )  # fmt: skip
