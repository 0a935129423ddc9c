"""A first state from the first readings that agree with each other: the "check of the first value" that recursive
gates need (a wrong one locks them out), done on a whole window."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.records import Observations, Start
from ftproc.core.model.frames import line_of_sight_axes, to_cartesian, wrap

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
    interval_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    gaps = gaps_of(time_s, good, shortest_gap(interval_s))
    edges = [*sorted(gaps), len(time_s)]
    for low, high in itertools.pairwise(edges):
        if low <= starts[-1].sample or (good[low:high].sum(0) < FEWEST_READINGS).any():
            continue
        if jerk_psd is None or too_long(gaps[low], measurement[low:high, 0][good[low:high, 0]], jerk_psd):
            starts.append(first_state(log, noise_variance, low, slice(low, high)))
    return starts


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
    interval = np.diff(time_s)
    found = {int(k) + 1: (float(interval[k]), WIDEST_BRIDGE) for k in np.flatnonzero(interval > longest_s)}
    for c in range(3):
        seen = np.flatnonzero(good[:, c])
        if not seen.size:
            continue
        blind = np.diff(time_s[seen], prepend=time_s[seen[0]] if last_good_s is None else last_good_s[c])
        for k in np.flatnonzero(blind > longest_s):
            found.setdefault(int(seen[k]), (float(blind[k]), WIDEST_BLIND_BRIDGE))
    return found


class _Line(NamedTuple):
    """A line through the readings of one component: value and rate at the start and their 1-sigma (infinite for the
    rate when all readings are of one instant); then the time over which a curve may have gone unseen, s: between the
    readings, and from them to the start."""

    value: float
    rate: float
    value_sigma: float
    rate_sigma: float
    unseen_s: float
    lead_s: float


def first_state(log: Observations, noise_variance: FloatArray, sample: int, within: slice) -> Start:
    """Start at `sample` from lines through the good readings nearest to it, among the samples of `within`.

    log: weights of zero for rejected readings. noise_variance (3,). Components are fitted one by one, so they need not
    come at the same instants. The covariance is inflated.
    Raises ValueError with the component's index when a component has no good reading in the span.
    """
    lines = []
    for c in range(3):
        good = np.flatnonzero((log.weight[within, c] > 0) & np.isfinite(log.measurement[within, c])) + within.start
        if len(good) == 0:
            raise ValueError(c)
        here = int(np.searchsorted(good, sample))
        good = good[max(here - SAMPLES, 0) : here + SAMPLES]  # the nearest are among these
        away = np.abs(log.time_s[good] - log.time_s[sample])
        nearest = np.argsort(away, kind="stable")[:SAMPLES]
        close = away[nearest] <= away[nearest[0]] + LONGEST_FIT_S
        chosen = np.sort(good[nearest[close | (np.arange(len(nearest)) < 2)]])
        z = log.measurement[chosen, c]
        if c == 1:
            z = z[0] + np.cumsum(np.r_[0.0, wrap(np.diff(z))])
        lines.append(_line(log.time_s[chosen] - log.time_s[sample], z, float(np.sqrt(noise_variance[c]))))
    return _to_state(sample, lines)


def _line(t: FloatArray, z: FloatArray, sigma: float) -> _Line:
    """The line at t = 0 through readings (m,) at times (m,) from the start.

    The scatter about the line stands for what it misses of a curve, so it is not averaged down; too few readings
    to show a curve leave it to the acceleration that must be allowed for.
    """
    lead = float(np.abs(t).min())
    span = float(np.ptp(t))
    if span <= 0:
        return _Line(float(z.mean()), 0.0, sigma, np.inf, 0.0, lead)
    middle = float(t.mean())
    spread = float(((t - middle) ** 2).sum())
    rate = float(((t - middle) * (z - z.mean())).sum()) / spread
    value = float(z.mean()) - rate * middle
    scatter = max(sigma, float(np.abs(z - value - rate * t).max()))
    rate_sigma = 4 * scatter / span
    unseen_s = span if len(t) < CURVE else 0.0
    return _Line(value, rate, float(np.hypot(scatter, rate_sigma * lead)), rate_sigma, unseen_s, lead)


def _to_state(sample: int, lines: list[_Line]) -> Start:
    """From range, azimuth, elevation and their rates to a Cartesian state with its covariance."""
    values, rates, value_sigma, rate_sigma, unseen_s, lead_s = np.array(lines).T.copy()
    slant = values[0] = max(values[0], 1.0)
    position = to_cartesian(values)
    axes = line_of_sight_axes(position[None])[0]
    scale = np.array([1.0, slant * np.cos(values[2]), slant])  # m per m, rad, rad along radial, cross, up
    curve = ACCELERATION_MPS2 * (unseen_s**2 / 8 + lead_s**2 / 2)
    along = np.minimum(scale * value_sigma + curve, WIDEST_IN_RANGES * slant)
    known = np.isfinite(rate_sigma)
    drift = np.where(known, scale * np.where(known, rate_sigma, 0.0), SPEED_MPS)
    speed_sigma = np.minimum(drift + ACCELERATION_MPS2 * (unseen_s / 2 + lead_s), SPEED_MPS)
    covariance = np.zeros((9, 9))
    covariance[:3, :3] = axes.T @ np.diag((INFLATION * along) ** 2) @ axes
    covariance[3:6, 3:6] = axes.T @ np.diag((INFLATION * speed_sigma) ** 2) @ axes
    covariance[6:, 6:] = np.eye(3) * ACCELERATION_MPS2**2
    velocity = axes.T @ (scale * rates)
    return Start(sample, np.r_[position, velocity, np.zeros(3)], covariance)
