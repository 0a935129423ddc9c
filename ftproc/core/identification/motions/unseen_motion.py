"""What the log cannot show of the motion, in the sigmas.

White jerk is a model, and its level is what the readings show. Motion that is faster than the filter or the smoother
follows, and smaller than the noise, shows nowhere: gusts, an oscillation, the beginning of a turn. It is what most of
the errors of velocity and acceleration on a quiet flight are.

A filter or smoother for white jerk follows frequencies up to w0, where w0^4 is the ratio of the variances of
acceleration and position that it leaves (in the middle of a long record these are n w0 / 3 and n w0^5 / 3, with n the
noise's density, m2 s). Of motion at a frequency w it leaves the share 1 / (1 + (w0 / w)^6) behind. In each octave
w = 2^k w0 such motion is taken to have

* no more of an acceleration than flights have there: AT_REST, and more with speed, since a gust of the same velocity
  pushes in proportion to airspeed (Pratt 1953; FAR 25.341), up to the frequency FASTEST of an airframe's own modes;
  where what flies has no wings, what a GUST along its path adds to its drag, which grows with the square of airspeed;
* no more of an amplitude than the noise would have hidden: a variance of HIDDEN w / w0 times that of the position,
  which is about half of the noise in the octave.

The two numbers of flights were measured on simulated and recorded ones: with them all axes of velocity and acceleration
lie inside three sigmas in 95 % of the rows (`python -m tests.bench sigmas`), without in 6 to 100 %.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.model.forces import AT_REST_MPS, GRAVITY
from ftproc.core.signatures import Matrix

FloatArray = NDArray[np.float64]

AT_REST = 0.1  # m/s2 in an octave
PER_SPEED = 1e-3  # m/s2 for each m/s
GUST_MPS = 1.0  # in an octave
FASTEST = 4.0  # rad/s; the octave above it has less and less
HIDDEN = 0.5
ROUNDING = 1e-15  # of a number, below which its last digits say nothing: no sigma is smaller


def widened(
    state: FloatArray, sigma: FloatArray, los_sigma: FloatArray, falls: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Sigmas (n, 9) of states (n, 9), and (n, 6) along the line of sight, SI units, that allow for unseen motion. NaN
    stays NaN. falls: whether the motion is ballistic."""
    wider = np.array(sigma, order="C"), np.array(los_sigma, order="C")
    _widen(np.ascontiguousarray(state), falls, *wider)
    least = np.stack([ROUNDING * np.sqrt((state[:, a : a + 3] ** 2).sum(1)) for a in (0, 3, 6)], 1)
    for each in wider:
        np.maximum(each, np.repeat(least, 3, 1)[:, : each.shape[1]], out=each)
    return wider


@kernel
def _widen(state: Matrix, falls: bool, sigma: Matrix, los_sigma: Matrix) -> None:
    """The same in place."""
    added = np.empty((3, 3))  # by axis: of position, velocity and acceleration, (m, s)^2
    for k in range(len(state)):
        x = state[k]
        v2 = x[3] * x[3] + x[4] * x[4] + x[5] * x[5]
        push = AT_REST * AT_REST + PER_SPEED * PER_SPEED * v2
        if falls:
            force2 = x[6] * x[6] + x[7] * x[7] + (x[8] + GRAVITY) * (x[8] + GRAVITY)
            push = 4 * GUST_MPS * GUST_MPS * force2 / (v2 + AT_REST_MPS * AT_REST_MPS)
        for i in range(3):
            _unseen(push, sigma[k, i], sigma[k, 6 + i], added[i])
            for j in range(3):
                sigma[k, 3 * j + i] = math.sqrt(sigma[k, 3 * j + i] * sigma[k, 3 * j + i] + added[i, j])
        ground = max(math.sqrt(x[0] * x[0] + x[1] * x[1]), 1e-9)
        slant = math.sqrt(ground * ground + x[2] * x[2])
        ca, sa, ce, se = x[0] / ground, x[1] / ground, ground / slant, x[2] / slant
        ca, sa, ce, se = ca * ca, sa * sa, ce * ce, se * se
        for j in range(2):
            ax, ay, az = added[0, j], added[1, j], added[2, j]
            along = ca * ax + sa * ay
            los_sigma[k, 3 * j] = math.sqrt(los_sigma[k, 3 * j] ** 2 + ce * along + se * az)
            los_sigma[k, 3 * j + 1] = math.sqrt(los_sigma[k, 3 * j + 1] ** 2 + sa * ax + ca * ay)
            los_sigma[k, 3 * j + 2] = math.sqrt(los_sigma[k, 3 * j + 2] ** 2 + se * along + ce * az)


@part
def _unseen(push: float, sigma: float, bend: float, added: FloatArray) -> None:
    """The variances of the position, velocity and acceleration of unseen motion along an axis. push: that of the
    acceleration in an octave, at most. sigma, bend: of the position and the acceleration as they are."""
    added[0] = added[1] = added[2] = 0.0
    if not (sigma > 0 and bend > 0):
        return
    w, times = math.sqrt(bend / sigma), 1.0  # rad/s; of the first octave
    while w < 2 * FASTEST and times < 1e12:
        left = 1 / (1 + 1 / (times * times * times * times * times * times))
        w2 = w * w
        flies = push * min(2 - w / FASTEST, 1.0) / max(w2 * w2, 1e-300)
        variance = left * left * min(flies, HIDDEN * times * sigma * sigma)
        added[0] += variance
        added[1] += w2 * variance
        added[2] += w2 * w2 * variance
        w, times = 2 * w, 2 * times
