"""A first state from the first readings that agree with each other: the "check of the first value" that recursive
gates need (a wrong one locks them out), done on a whole window."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel
from ftproc.core.filtering.records import Observations, Start
from ftproc.core.model.measurement import wrapped
from ftproc.core.signatures import Indices, Matrix, Vector

FloatArray = NDArray[np.float64]

SAMPLES = 15  # good readings of each component wanted for the first fit,
LONGEST_FIT_S = 20.0  # if they lie so close together
LONGEST_REACH_S = 3.0  # back from the first good readings to the first sample
GAP_INTERVALS, GAP_S = 20, 5.0  # median intervals and seconds: a longer one is a gap
WIDEST_BRIDGE = 0.06  # of the range, over a gap of all components
WIDEST_BLIND_BRIDGE = 0.2  # of the range, over a gap of one component: the others hold the track meanwhile
FEWEST_READINGS = 8  # of each component after a gap, for a start of its own
CURVE = 5  # readings that show a curve
INFLATION = 3.0  # on every sigma of the first state: its readings are filtered again, so it must weigh little
ACCELERATION_MPS2 = 30.0  # 1-sigma of an acceleration about which nothing is known
SPEED_MPS = 1000.0  # 1-sigma of a speed about which nothing is known
WIDEST_IN_RANGES = 0.1  # the position must not be so vague that the target may be behind the station


def first_start(log: Observations, noise_variance: FloatArray) -> Start:
    """The start of a log: at its first sample, or, when that would mean reaching back far, where every component has
    been seen once. Errors as in `first_state`."""
    good = (log.weight > 0) & np.isfinite(log.measurement)
    if not good.any(0).all():
        raise ValueError(int(np.argmin(good.any(0))))
    sample = int(good.argmax(0).max())
    if log.time_s[sample] - log.time_s[0] <= LONGEST_REACH_S:
        sample = 0
    return first_state(log, noise_variance, sample, slice(0, len(log.time_s)))


def find_starts(log: Observations, noise_variance: FloatArray, jerk_psd: float | None) -> list[Start]:
    """The start of a log, and one more after every gap that is too long to bridge.

    A gap of G seconds is too long when the position has by its end become uncertain by a noticeable share of the range,
    sqrt(q G^5 / 20) > WIDEST_BRIDGE R: a filter that came through it would linearise about a wrong place. With
    jerk_psd None (m^2/s^5, not known yet) every gap is taken to be so. Errors as in `first_state`.
    """
    time_s, measurement, weight = log
    starts = [first_start(log, noise_variance)]
    good = (weight > 0) & np.isfinite(measurement)
    interval_s = _median(time_s[1:] - time_s[:-1]) if len(time_s) > 1 else 0.0
    gaps = gaps_of(time_s, good, shortest_gap(interval_s))
    edges = [*sorted(gaps), len(time_s)]
    for low, high in itertools.pairwise(edges):
        if low <= starts[-1].sample or (good[low:high].sum(0) < FEWEST_READINGS).any():
            continue
        if jerk_psd is None or too_long(gaps[low], measurement[low:high, 0][good[low:high, 0]], jerk_psd):
            starts.append(first_state(log, noise_variance, low, slice(low, high)))
    return starts


def _median(values: FloatArray) -> float:
    """numpy's, in a tenth of the time where there are few values."""
    middle = [(len(values) - 1) // 2, len(values) // 2]
    return float(np.partition(values, middle)[middle].mean())


def too_long(gap: tuple[float, float], range_m: FloatArray, jerk_psd: float) -> bool:
    """Whether a filter that came through a gap (see `gaps_of`) would linearise about a wrong place; range_m: (m,)
    good ranges after it."""
    duration_s, widest = gap
    return bool(np.sqrt(jerk_psd * duration_s**5 / 20) > widest * float(np.median(range_m)))


def shortest_gap(interval_s: float) -> float:
    """Seconds without readings beyond which a log of this median interval has a gap."""
    return max(GAP_INTERVALS * interval_s, GAP_S)


def gaps_of(
    time_s: FloatArray, good: NDArray[np.bool_], longest_s: float, last_good_s: FloatArray | None = None
) -> dict[int, tuple[float, float]]:
    """The first sample after each gap, with the gap's length in s and how uncertain (in ranges) the position may be by
    its end: gaps between samples, and those in which one component has no good reading. good (n, 3).

    last_good_s: (3,) when each component was seen before the first sample; NaN for never."""
    interval = time_s[1:] - time_s[:-1]
    found = {int(k) + 1: (float(interval[k]), WIDEST_BRIDGE) for k in np.flatnonzero(interval > longest_s)}
    for c in range(3):
        seen = np.flatnonzero(good[:, c])
        if not seen.size:
            continue
        times = time_s[seen]
        for k in np.flatnonzero(times[1:] - times[:-1] > longest_s) + 1:
            found.setdefault(int(seen[k]), (float(times[k] - times[k - 1]), WIDEST_BLIND_BRIDGE))
        if last_good_s is not None and times[0] - last_good_s[c] > longest_s:
            found.setdefault(int(seen[0]), (float(times[0] - last_good_s[c]), WIDEST_BLIND_BRIDGE))
    return found


def first_state(log: Observations, noise_variance: FloatArray, sample: int, within: slice) -> Start:
    """Start at `sample` from lines through the good readings nearest to it, among the samples of `within`.

    log: weights of zero for rejected readings. noise_variance (3,). Components are fitted one by one, so they need not
    come at the same instants. The covariance is inflated.
    Raises ValueError with the component's index when a component has no good reading in the span.
    """
    time, z, weight = (np.ascontiguousarray(each) for each in log)
    lines = np.empty((3, 6))
    for c in range(3):
        chosen = _nearest(time, z, weight, sample, within.start, within.stop, c)
        if len(chosen) == 0:
            raise ValueError(c)
        _line(time, z, chosen, sample, c, math.sqrt(noise_variance[c]), lines[c])
    return Start(sample, *_to_state(lines))


@kernel
def _nearest(time: Vector, z: Matrix, weight: Matrix, sample: int, first: int, last: int, c: int) -> Indices:
    """Up to SAMPLES good readings of a component nearest in time to `sample` among the samples [first, last), in their
    order; all but two of them close together."""
    near = np.empty(2 * SAMPLES, np.int64)
    count = 0
    k = sample - 1
    while k >= first and count < SAMPLES:
        if weight[k, c] > 0 and math.isfinite(z[k, c]):
            near[count] = k
            count += 1
        k -= 1
    near[:count] = near[:count][::-1].copy()
    before, k = count, max(sample, first)
    while k < last and count < before + SAMPLES:
        if weight[k, c] > 0 and math.isfinite(z[k, c]):
            near[count] = k
            count += 1
        k += 1
    shortest = math.inf
    for i in range(count):
        shortest = min(shortest, abs(time[near[i]] - time[sample]))
    low, high = 0, count
    while high - low > 2:  # drop the farther end, until there are few enough and all are close
        left, right = abs(time[near[low]] - time[sample]), abs(time[near[high - 1]] - time[sample])
        if high - low <= SAMPLES and max(left, right) <= shortest + LONGEST_FIT_S:
            break
        if left > right:
            low += 1
        else:
            high -= 1
    return near[low:high].copy()


@kernel
def _line(time: Vector, z: Matrix, chosen: Indices, sample: int, c: int, sigma: float, line: Vector) -> None:
    """The line through the chosen readings at the time of `sample`.

    line (6,): value and rate there and their 1-sigma (infinite for the rate when all readings are of one instant); then
    the time over which a curve may have gone unseen, s: between the readings, and from them to the sample. The scatter
    about the line stands for what it misses of a curve, so it is not averaged down; too few readings to show a curve
    leave it to the acceleration that must be allowed for.
    """
    m = len(chosen)
    t, v = np.empty(m), np.empty(m)
    lead, middle, mean = math.inf, 0.0, 0.0
    for i in range(m):
        t[i] = time[chosen[i]] - time[sample]
        v[i] = z[chosen[i], c] if i == 0 else v[i - 1] + wrapped(z[chosen[i], c] - z[chosen[i - 1], c], c == 1)
        lead = min(lead, abs(t[i]))
        middle += t[i] / m
        mean += v[i] / m
    span = t[m - 1] - t[0]
    line[0], line[1], line[2], line[3], line[4], line[5] = mean, 0.0, sigma, math.inf, 0.0, lead
    if span <= 0:
        return
    spread = slope = 0.0
    for i in range(m):
        spread += (t[i] - middle) ** 2
        slope += (t[i] - middle) * (v[i] - mean)
    rate = slope / spread
    value = mean - rate * middle
    scatter = sigma
    for i in range(m):
        scatter = max(scatter, abs(v[i] - value - rate * t[i]))
    line[0], line[1], line[3], line[4] = value, rate, 4 * scatter / span, span if m < CURVE else 0.0
    line[2] = math.hypot(scatter, line[3] * lead)


@kernel
def _to_state(lines: Matrix) -> tuple[Vector, Matrix]:
    """From range, azimuth, elevation and their rates, rows of `_Line`s (3, 6), to a Cartesian state with its
    covariance."""
    slant, azimuth, elevation = max(lines[0, 0], 1.0), lines[1, 0], lines[2, 0]
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    axes = np.empty((3, 3))  # radial, cross, up
    axes[0, 0], axes[0, 1], axes[0, 2] = ca * ce, sa * ce, se
    axes[1, 0], axes[1, 1], axes[1, 2] = -sa, ca, 0.0
    axes[2, 0], axes[2, 1], axes[2, 2] = -ca * se, -sa * se, ce
    state, covariance = np.zeros(9), np.zeros((9, 9))
    for k in range(3):
        scale = 1.0 if k == 0 else slant * (ce if k == 1 else 1.0)  # m per m, rad, rad along these
        rate, value_sigma, rate_sigma, unseen_s, lead_s = (
            lines[k, 1],
            lines[k, 2],
            lines[k, 3],
            lines[k, 4],
            lines[k, 5],
        )
        curve = ACCELERATION_MPS2 * (unseen_s**2 / 8 + lead_s**2 / 2)
        along = INFLATION * min(scale * value_sigma + curve, WIDEST_IN_RANGES * slant)
        drift = scale * rate_sigma if math.isfinite(rate_sigma) else SPEED_MPS
        speed = INFLATION * min(drift + ACCELERATION_MPS2 * (unseen_s / 2 + lead_s), SPEED_MPS)
        for i in range(3):
            state[i] += slant * axes[0, i] if k == 0 else 0.0
            state[3 + i] += axes[k, i] * scale * rate
            for j in range(3):
                covariance[i, j] += axes[k, i] * along**2 * axes[k, j]
                covariance[3 + i, 3 + j] += axes[k, i] * speed**2 * axes[k, j]
    for i in range(6, 9):
        covariance[i, i] = ACCELERATION_MPS2**2
    return state, covariance
