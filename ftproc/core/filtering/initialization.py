"""A first state from the first readings that agree with each other: the "check of the first value" that recursive
gates need (a wrong one locks them out), done on a whole window."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.filtering.records import Observations, Start
from ftproc.core.model.measurement import NO_RANGE_M, wrapped
from ftproc.core.signatures import Indices, Matrix, Vector
from ftproc.order_statistics import typical

FloatArray = NDArray[np.float64]

SAMPLES = 15  # good readings of each component wanted for the first fit, fewer if they lie on no parabola
CURVE = 5  # readings that show a curve
FITS = 4.0  # sigmas from the parabola that a reading of the first fit may be off
GAP_INTERVALS = 20  # median intervals: a longer one is a gap
WIDEST_BRIDGE = 0.06  # of the range, over a gap of all components
WIDEST_BLIND_BRIDGE = 0.2  # of the range, over a gap of one component: the others hold the track meanwhile
FEWEST_READINGS = 8  # of each component after a gap, for a start of its own
INFLATION = 3.0  # on every sigma of the first state: its readings are filtered again, so it must weigh little
WIDEST_IN_RANGES = 0.1  # the position must not be so poorly known that the target may be behind the station
ONE_SECOND = 1.0  # in which a target may have passed its own range, if all its readings are of one instant


def first_start(log: Observations, noise_variance: FloatArray) -> Start:
    """The start of a log: at its first sample, or, where its position would be too uncertain, where each component was
    seen. Errors as in `first_state`."""
    everything = slice(0, len(log.time_s))
    start = first_state(log, noise_variance, 0, everything)
    sigma_m, range_m = math.sqrt(np.trace(start.covariance[:3, :3])), float(np.linalg.norm(start.state[:3]))
    if not sigma_m <= INFLATION * WIDEST_BRIDGE * max(range_m, NO_RANGE_M):
        seen = int(((log.weight > 0) & np.isfinite(log.measurement)).argmax(0).max())
        start = first_state(log, noise_variance, seen, everything) if seen > 0 else start
    return start


def find_starts(
    log: Observations, noise_variance: FloatArray, jerk_psd: float, profile: FloatArray | None = None
) -> list[Start]:
    """The start of a log, and one more after every gap that is too long to bridge.

    A gap of G seconds is too long when the position has by its end become uncertain by a noticeable share of the range,
    sqrt(q G^5 / 20) > WIDEST_BRIDGE R: a filter that came through it would linearise about a wrong place. jerk_psd: q,
    m^2/s^5; profile: (n,) the same at each sample: beside a gap between samples it counts if it is more.
    """
    time_s, measurement, weight = log[:3]
    most = jerk_psd if profile is None else max(jerk_psd, float(profile.max()))
    starts = [first_start(log, noise_variance)]
    longest, shortest, nearest_m = _extremes(*(np.ascontiguousarray(each) for each in log[:3]))
    bridged = not np.sqrt(most * longest**5 / 20) > 0.99 * WIDEST_BRIDGE * nearest_m  # as every shorter gap is
    if bridged or longest <= shortest_gap(shortest):  # so it is by the typical interval
        return starts
    longest_s = shortest_gap(typical(time_s[1:] - time_s[:-1]))
    if longest <= longest_s:
        return starts
    good = (weight > 0) & np.isfinite(measurement)
    gaps = gaps_of(time_s, good, longest_s)
    edges = [*sorted(gaps), len(time_s)]
    for low, high in itertools.pairwise(edges):
        if low <= starts[-1].sample or (good[low:high].sum(0) < FEWEST_READINGS).any():
            continue
        level = jerk_psd
        if profile is not None and gaps[low][1] == WIDEST_BRIDGE:
            level = max(level, float(profile[low - 1 : low + 1].max()))
        if too_long(gaps[low], measurement[low:high, 0][good[low:high, 0]], level):
            starts.append(first_state(log, noise_variance, low, slice(low, high)))
    return starts


def too_long(gap: tuple[float, float], range_m: FloatArray, jerk_psd: float) -> bool:
    """Whether a filter that came through a gap (see `gaps_of`) would linearise about a wrong place; range_m: (m,)
    good ranges after it."""
    duration_s, widest = gap
    return bool(np.sqrt(jerk_psd * duration_s**5 / 20) > widest * typical(range_m))


def shortest_gap(interval_s: float) -> float:
    """Seconds without readings beyond which a log of this median interval has a gap."""
    return GAP_INTERVALS * interval_s


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


@kernel
def _extremes(time: Vector, z: Matrix, weight: Matrix) -> tuple[float, float, float]:
    """The longest time between samples, or between good readings of a component, and the shortest between samples; and
    the shortest good range."""
    longest, shortest, nearest = 0.0, math.inf, math.inf
    for k in range(1, len(time)):
        longest, shortest = max(longest, time[k] - time[k - 1]), min(shortest, time[k] - time[k - 1])
    for c in range(3):
        last = math.inf
        for k in range(len(time)):
            if weight[k, c] > 0 and math.isfinite(z[k, c]):
                longest, last = max(longest, time[k] - last), time[k]
                if c == 0:
                    nearest = min(nearest, z[k, c])
    return longest, shortest, nearest


def first_state(log: Observations, noise_variance: FloatArray, sample: int, within: slice) -> Start:
    """Start at `sample` from parabolas through the good readings nearest to it, among the samples of `within`.

    log: weights of zero for rejected readings. noise_variance (3,). Components are fitted one by one, so they need not
    come at the same instants. The covariance is inflated.
    Raises ValueError with the component's index when a component has no good reading in the span.
    """
    time, z, weight = (np.ascontiguousarray(each) for each in log[:3])
    state, covariance = _first_state(time, z, weight, sample, within.start, within.stop, np.sqrt(noise_variance))
    if math.isnan(state[0]):
        seen = ((weight > 0) & np.isfinite(z))[within].any(0)
        if not seen.all():
            raise ValueError(int(np.argmin(seen)))
    return Start(sample, state, covariance)


@kernel
def _first_state(
    time: Vector, z: Matrix, weight: Matrix, sample: int, first: int, last: int, sigma: Vector
) -> tuple[Vector, Matrix]:
    """The state at a sample from its nearest readings among the samples [first, last), and its covariance; NaN where a
    component has none. sigma (3,) of the readings."""
    fits, span = np.empty((3, 6)), 0.0
    for c in range(3):
        chosen = _nearest(time, z, weight, sample, first, last, c)
        if len(chosen) == 0:
            return np.full(9, math.nan), np.full((9, 9), math.nan)
        span = max(span, _fit(time, z, chosen, sample, c, sigma[c], fits[c]))
    return _to_state(fits, span)


@part
def _nearest(time: Vector, z: Matrix, weight: Matrix, sample: int, first: int, last: int, c: int) -> Indices:
    """The SAMPLES good readings of a component nearest in time to `sample` among the samples [first, last), or as many
    as there are, in their order."""
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
    low, high = 0, count
    while high - low > SAMPLES:
        if abs(time[near[low]] - time[sample]) > abs(time[near[high - 1]] - time[sample]):
            low += 1
        else:
            high -= 1
    return near[low:high].copy()


@part
def _fit(time: Vector, z: Matrix, chosen: Indices, sample: int, c: int, sigma: float, fit: Vector) -> float:
    """The parabola through the chosen readings at the time of `sample`: value, rate and its change, and the 1-sigma
    of each, in fit (6,). Returns the seconds over which the readings extend; without any, rates have infinite sigmas.

    Readings on both sides of a manoeuvre lie on no parabola: then the farthest are left out, one by one. The scatter
    about it stands for what it misses of the motion, so it is not averaged down: it may hide a cubic, which grows away
    from the readings as Legendre's third polynomial does. Too few readings to show a curve lie on a line, and leave it
    open that the target has turned.
    """
    m = len(chosen)
    t, v, away = np.empty(m), np.empty(m), np.empty(m)
    for i in range(m):
        t[i] = time[chosen[i]] - time[sample]
        v[i] = z[chosen[i], c] if i == 0 else v[i - 1] + wrapped(z[chosen[i], c] - z[chosen[i - 1], c], c == 1)
    low, high = 0, m
    scatter = sigma
    while True:
        span = t[high - 1] - t[low]
        curved = high - low >= CURVE
        _least_squares(t[low:high], v[low:high], curved and span > 0, span, fit)
        scatter = sigma
        for i in range(low, high):
            away[i] = abs(v[i] - fit[0] - t[i] * (fit[1] + 0.5 * t[i] * fit[2]))
            scatter = max(scatter, away[i])
        if high - low <= CURVE or scatter <= FITS * sigma:
            break
        if abs(t[low]) > abs(t[high - 1]):
            low += 1
        else:
            high -= 1
    lead = min(abs(t[low]), abs(t[high - 1])) if t[low] * t[high - 1] > 0 else 0.0
    fit[3], fit[4], fit[5] = scatter if lead == 0 else math.inf, math.inf, math.inf
    if span > 0:
        away_from = 1 + 2 * lead / span  # the readings, whose half span is 1
        fit[3] = scatter * 0.5 * away_from * (5 * away_from * away_from - 3)
        fit[4] = scatter / span * (7.5 * away_from * away_from - 1.5)
        fit[5] = 12 * scatter / (span * span) * away_from
        if not curved:
            unseen = (abs(fit[1]) + fit[4]) / span
            fit[5] += unseen
            fit[4] += unseen * lead
            fit[3] += unseen * lead * lead
    return float(span)


@part
def _least_squares(t: FloatArray, v: FloatArray, curved: bool, span: float, fit: FloatArray) -> None:
    """Fill fit[:3] with value, slope and second derivative at t = 0 of the parabola through (t, v), or of the line, or
    of the mean, if there is no span. Orthogonal polynomials about the middle."""
    m = len(t)
    middle = mean = 0.0
    for i in range(m):
        middle += t[i] / m
        mean += (v[i] - v[0]) / m
    mean += v[0]
    fit[0], fit[1], fit[2] = mean, 0.0, 0.0
    if span <= 0:
        return
    s2 = s3 = slope = 0.0
    for i in range(m):
        d = t[i] - middle
        s2 += d * d
        s3 += d * d * d
        slope += d * (v[i] - mean)
    slope /= s2
    fit[0], fit[1] = mean - slope * middle, slope
    if not curved:
        return
    tilt, level = s3 / s2, s2 / m
    size = bend = 0.0
    for i in range(m):
        d = t[i] - middle
        shape = d * d - tilt * d - level
        size += shape * shape
        bend += shape * (v[i] - mean)
    if size > 1e-9 * level * level * m:  # not all at two instants
        bend /= size
        fit[0] += bend * (middle * middle + tilt * middle - level)
        fit[1] -= bend * (2 * middle + tilt)
        fit[2] = 2 * bend


@part
def _to_state(fits: Matrix, span: float) -> tuple[Vector, Matrix]:
    """From range, azimuth, elevation with their first and second derivatives, rows of `_fit` (3, 6), to a Cartesian
    state with its covariance. span: the longest of the fits, s."""
    slant, azimuth, elevation = fits[0, 0] if fits[0, 0] > 0 else fits[0, 3], fits[1, 0], fits[2, 0]
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    axes = np.empty((3, 3))  # radial, cross, up
    axes[0, 0], axes[0, 1], axes[0, 2] = ca * ce, sa * ce, se
    axes[1, 0], axes[1, 1], axes[1, 2] = -sa, ca, 0.0
    axes[2, 0], axes[2, 1], axes[2, 2] = -ca * se, -sa * se, ce
    away, around, rising = fits[0, 1], fits[1, 1], fits[2, 1]
    turning = np.empty(3)  # acceleration along these axes
    turning[0] = fits[0, 2] - slant * (rising * rising + (around * ce) ** 2)
    turning[1] = ce * (slant * fits[1, 2] + 2 * away * around) - 2 * slant * around * rising * se
    turning[2] = slant * fits[2, 2] + 2 * away * rising + slant * around * around * se * ce
    unknown = slant / (span if span > 0 else ONE_SECOND)  # a speed that would have taken it past its own range
    state, covariance = np.zeros(9), np.zeros((9, 9))
    for k in range(3):
        scale = 1.0 if k == 0 else slant * (ce if k == 1 else 1.0)  # m per m, rad, rad along these
        along = INFLATION * min(scale * fits[k, 3], WIDEST_IN_RANGES * slant)
        speed = INFLATION * (scale * fits[k, 4] if math.isfinite(fits[k, 4]) else unknown)
        bend = INFLATION * (scale * fits[k, 5] if math.isfinite(fits[k, 5]) else unknown * unknown / slant)
        known = math.isfinite(fits[k, 5])
        for i in range(3):
            state[i] += slant * axes[0, i] if k == 0 else 0.0
            state[3 + i] += axes[k, i] * scale * fits[k, 1]
            state[6 + i] += axes[k, i] * turning[k] if known else 0.0
            for j in range(3):
                covariance[i, j] += axes[k, i] * along**2 * axes[k, j]
                covariance[3 + i, 3 + j] += axes[k, i] * speed**2 * axes[k, j]
                covariance[6 + i, 6 + j] += axes[k, i] * bend**2 * axes[k, j]
    return state, covariance
