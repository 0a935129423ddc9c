"""A first track from the readings of several stations: points where their lines of sight and ranges meet, second by
second, and through them the path that jumps least, by costs that a wrong station cannot dominate."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from ftproc.core.model import stations as model
from ftproc.core.model.frames import from_cartesian, to_cartesian, unwrap, wrap
from ftproc.fusion.estimation.events import Seen
from ftproc.records import FloatArray, IntArray

MOST_POINTS, SHORTEST_S = 3000, 0.5  # of the track, and between two
LONGEST_GAP, LONGEST_GAP_S = 6.0, 2.0  # intervals and seconds over which readings are interpolated
ALLOWANCE = 1.5  # on noise and prior of a reading
ROBUST = 5.0  # sigmas from which a reading loses its pull
STEPS, POLISH = 12, 6
MOST_CANDIDATES = 12  # that are fitted to all readings: those that are often among the best of the moment
WIDEST = 0.1  # of the distance: 1-sigma of a point that counts
SMOOTHED = 4  # points on each side through which the track is drawn
PATCH_S = 5.0  # over which a contradiction counts once: patches last
PREDICTED, HARD, FAST = 2.0, 50.0, 2.0  # times its 1-sigma of a predicted point; m/s2; times the median speed
AWAY = 4.0  # times the median distance from its neighbours, and sigmas, that a point may be off


class Track(NamedTuple):
    """time_s (m,); state (m, 6) position m and velocity m/s; sigma (m,) 1-sigma of the position, m."""

    time_s: FloatArray
    state: FloatArray
    sigma: FloatArray

    def at(self, time_s: FloatArray) -> FloatArray:
        """(n, 9) states, along straight lines beyond the ends, with no acceleration."""
        from scipy.interpolate import CubicHermiteSpline

        inside = np.clip(time_s, self.time_s[0], self.time_s[-1])
        if len(self.time_s) == 1:
            position, velocity = (
                np.repeat(self.state[:, :3], len(inside), 0),
                np.repeat(self.state[:, 3:], len(inside), 0),
            )
        else:
            curve = CubicHermiteSpline(self.time_s, self.state[:, :3], self.state[:, 3:6])
            position, velocity = curve(inside), curve(inside, 1)
        beyond = (time_s - inside)[:, None]
        return np.hstack([position + beyond * velocity, velocity, np.zeros_like(position)])


def find(stations: list[Seen], weight: list[FloatArray], sigma: FloatArray) -> Track | None:
    """The first track; None where no point is determined. weight: (rows, 3) of each station. sigma: (m, 3) noise."""
    first, last = min(s.time_s[0] for s in stations), max(s.time_s[-1] for s in stations)
    every = max(SHORTEST_S, (last - first) / MOST_POINTS)
    time_s = np.arange(first, last + every, every)
    readings = np.stack([_on_grid(s, w, time_s) for s, w in zip(stations, weight, strict=True)], 1)
    allowed = np.stack([ALLOWANCE * np.hypot(sigma[k], s.prior[:3]) for k, s in enumerate(stations)])
    allowed = np.maximum(allowed, 1e-12)
    seen = np.isfinite(readings).any((1, 2))
    if not seen.any():
        return None
    time_s, readings = time_s[seen], readings[seen]
    candidates = _candidates(stations, readings)
    if len(candidates) > MOST_CANDIDATES:
        candidates = _leading(candidates, [_fitted(stations, readings, allowed, each, 0)[1] for each in candidates])
    found = [_fitted(stations, readings, allowed, each, POLISH) for each in candidates]
    if not found:
        return None
    points, costs = np.stack([each[0] for each in found]), np.stack([each[1] for each in found])
    spreads = np.stack([_spread(each[2]) for each in found])
    distance = np.min([np.linalg.norm(points - s.place, axis=2) for s in stations], 0)
    costs = np.where(spreads < WIDEST * np.maximum(distance, 100.0), costs, np.inf)
    there = np.isfinite(costs).any(0)
    if there.sum() < 3:
        return None
    time_s, points, costs, spreads = time_s[there], points[:, there], costs[:, there], spreads[:, there]
    along = (_likeliest_path(time_s, points, costs, spreads), np.arange(len(time_s)))
    return _drawn(time_s, points[along], spreads[along])


def _spread(covariance: FloatArray) -> FloatArray:
    """(g,) 1-sigma of points, m."""
    found: FloatArray = np.sqrt(np.maximum(np.trace(covariance, axis1=1, axis2=2), 0.0))
    return found


def _likeliest_path(time_s: FloatArray, points: FloatArray, costs: FloatArray, spreads: FloatArray) -> IntArray:
    """(g,) which of the candidates (k, g, 3) a flight goes through that seldom jumps and contradicts few readings.
    costs, spreads (k, g): the cost is infinite where there is no candidate. By the Viterbi algorithm."""
    interval = np.diff(time_s)
    step = np.linalg.norm(np.diff(points, axis=1), axis=2)
    both = np.isfinite(costs[:, 1:]) & np.isfinite(costs[:, :-1])
    speed = float(np.median(np.where(both, step / interval, np.nan)[both])) if both.any() else 0.0
    reached, came = costs[:, 0], np.zeros(costs.shape, int)
    velocity, moving = np.zeros_like(points[:, 0]), np.zeros(len(points), bool)
    for k, dt in enumerate(interval, 1):
        expected = points[:, k - 1] + dt * velocity
        allowed = PREDICTED * spreads[:, k - 1] + np.where(moving, 0.5 * HARD * dt**2, FAST * speed * dt)
        off = np.linalg.norm(points[None, :, k] - expected[:, None], axis=2)
        total = reached[:, None] + np.log1p((off / (allowed[:, None] + spreads[None, :, k])) ** 2)
        came[:, k] = total.argmin(0)
        reached = total.min(0) + costs[:, k] * min(dt / PATCH_S, 1.0)
        moving = both[:, k - 1]
        velocity = np.where(moving[:, None], points[:, k] - points[:, k - 1], 0.0) / dt
    path = np.full(len(time_s), int(reached.argmin()))
    for k in range(len(time_s) - 1, 0, -1):
        path[k - 1] = came[path[k], k]
    return path


def _on_grid(station: Seen, weight: FloatArray, time_s: FloatArray) -> FloatArray:
    """(g, 3) readings interpolated to times (g,); NaN where there is none near."""
    found = np.full((len(time_s), 3), np.nan)
    for c in station.components:
        rows = np.flatnonzero((weight[:, c] > 0) & np.isfinite(station.measurement[:, c]))
        if len(rows) < 4:
            continue
        at, values = station.time_s[rows], station.measurement[rows, c]
        values = unwrap(values) if c == 1 else values
        interval = float(np.median(np.diff(at)))
        place = np.clip(np.searchsorted(at, time_s), 1, len(at) - 1)
        near = at[place] - at[place - 1] <= max(LONGEST_GAP * interval, LONGEST_GAP_S)
        near &= (time_s >= at[0] - interval) & (time_s <= at[-1] + interval)
        found[near, c] = np.interp(time_s[near], at, values)
    return found


def _candidates(stations: list[Seen], readings: FloatArray) -> list[FloatArray]:
    """Points (g, 3) from few readings each: of a station with range and angles, of two lines of sight, of a line of
    sight and a range, of ranges alone."""
    found = []
    angles = [k for k in range(len(stations)) if np.isfinite(readings[:, k, 1:]).all(1).any()]
    ranges = [k for k in range(len(stations)) if np.isfinite(readings[:, k, 0]).any()]
    sight = {k: to_cartesian(np.c_[np.ones(len(readings)), readings[:, k, 1:]]) @ stations[k].axes for k in angles}
    for k in angles:
        if k in ranges:
            found.append(stations[k].place + readings[:, k, :1] * sight[k])
    for a, b in itertools.combinations(angles, 2):
        found.append(_nearest_point(stations[a].place, sight[a], stations[b].place, sight[b]))
    for a, b in itertools.product(angles, ranges):
        if a != b:
            found += _on_sphere(stations[a].place, sight[a], stations[b].place, readings[:, b, 0])
    if len(ranges) >= 3 and not angles:
        middle = np.mean([s.place for s in stations], 0)
        reach = float(np.nanmedian(readings[:, ranges, 0]))
        for turn in np.arange(8) * np.pi / 4:
            offset = 0.7 * reach * np.array([np.cos(turn), np.sin(turn), 0.3])
            start = np.tile(middle + offset, (len(readings), 1))
            found.append(_fitted(stations, readings, np.full((len(stations), 3), reach / 20), start, STEPS)[0])
    return found


def _leading(candidates: list[FloatArray], costs: list[FloatArray]) -> list[FloatArray]:
    """The candidates that are most often among the best of a moment. costs: (g,) of each."""
    order = np.argsort(costs, 0)[:MOST_CANDIDATES]
    there = np.isfinite(np.take_along_axis(np.stack(costs), order, 0))
    times = np.bincount(order[there], minlength=len(candidates))
    return [candidates[k] for k in np.argsort(-times, kind="stable")[:MOST_CANDIDATES]]


def _nearest_point(at: FloatArray, along: FloatArray, other: FloatArray, sight: FloatArray) -> FloatArray:
    """(g, 3) halfway between two lines where they are nearest; NaN where they are parallel or meet behind."""
    between, cosine = other - at, (along * sight).sum(1)
    sine2 = np.where(1 - cosine**2 > 1e-6, 1 - cosine**2, np.nan)
    p, q = along @ between, sight @ between
    s, t = (p - q * cosine) / sine2, (p * cosine - q) / sine2
    s, t = np.where(s > 0, s, np.nan), np.where(t > 0, t, np.nan)
    return 0.5 * (at + s[:, None] * along + other + t[:, None] * sight)


def _on_sphere(at: FloatArray, along: FloatArray, centre: FloatArray, radius: FloatArray) -> list[FloatArray]:
    """(g, 3) both points of a line of sight at a distance from a centre, or twice its nearest to the centre; NaN where
    they are behind."""
    between = at - centre
    half = along @ between
    root = np.sqrt(np.maximum(half**2 - between @ between + radius**2, 0.0))
    reaches = root - half, -root - half
    return [at + np.where(reach > 0, reach, np.nan)[:, None] * along for reach in reaches]


def _fitted(
    stations: list[Seen], readings: FloatArray, allowed: FloatArray, start: FloatArray, steps: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points (g, 3) after so many Gauss-Newton steps with Cauchy weights, their cost (g,), and covariance (g, 3, 3)."""
    point = np.where(np.isfinite(start), start, 0.0)
    lost = ~np.isfinite(start).all(1)
    eye = np.eye(3)
    for step in range(steps + 1):
        normal, slope, cost = np.tile(1e-12 * eye, (len(point), 1, 1)), np.zeros_like(point), np.zeros(len(point))
        for k, station in enumerate(stations):
            seen = model.local(point, station.place, station.axes)
            jacobian = model.jacobian(seen) @ station.axes
            off = (readings[:, k] - from_cartesian(seen)) / allowed[k]
            off[:, 1] = wrap(off[:, 1] * allowed[k, 1]) / allowed[k, 1]
            there = np.isfinite(off)
            off = np.where(there, off, 0.0)
            pull = np.where(there, 1 / (1 + (off / ROBUST) ** 2), 0.0)
            rows = jacobian / allowed[k][:, None]
            normal += np.einsum("gc,gci,gcj->gij", pull, rows, rows)
            slope += np.einsum("gc,gci->gi", pull * off, rows)
            cost += np.where(there, np.log1p((off / ROBUST) ** 2), 0.0).sum(1)
        scale = np.sqrt(np.maximum(np.einsum("gii->gi", normal), 1e-30))
        damped = normal / (scale[:, :, None] * scale[:, None, :]) + 1e-9 * eye
        if step == steps:
            inverse = np.linalg.inv(damped) / (scale[:, :, None] * scale[:, None, :])
            return point, np.where(lost, np.inf, cost), inverse
        point = point + np.linalg.solve(damped, (slope / scale)[:, :, None])[:, :, 0] / scale
    raise AssertionError


def _drawn(time_s: FloatArray, point: FloatArray, spread: FloatArray) -> Track:
    """The points without those far from their neighbours, and parabolas through what is near each of the others."""
    from scipy.ndimage import median_filter

    away = np.linalg.norm(point - median_filter(point, size=(2 * SMOOTHED + 1, 1), mode="nearest"), axis=1)
    good = away <= AWAY * np.median(away) + AWAY * spread
    if good.sum() >= 3:
        time_s, point, spread = time_s[good], point[good], spread[good]
    n, width = len(time_s), min(2 * SMOOTHED + 1, len(time_s))
    low = np.clip(np.arange(n) - SMOOTHED, 0, n - width)
    near = low[:, None] + np.arange(width)
    t = time_s[near] - time_s[:, None]
    span = np.maximum(np.ptp(t, axis=1), 1e-9)[:, None]
    powers = np.stack([np.ones_like(t), t / span, (t / span) ** 2], 2) / spread[near][:, :, None]
    fit = np.linalg.pinv(powers) @ (point[near] / spread[near][:, :, None])
    return Track(time_s, np.hstack([fit[:, 0], fit[:, 1] / span]), spread)
