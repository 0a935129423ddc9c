"""Over gaps that are too long to bridge, both sides say about which places readings are linearised.

A filter that coasts until the target may be anywhere linearises about a wrong place, and then takes its own error for
a measurement: with angles alone the target runs away, or turns back to the station where all motion costs little; with
the range alone it circles. So it is started again after such a gap (`initialization`). The whole record knows where the
target came out of it. About a curve through the gap all is linear: the track is one, and its sigmas are those of the
motion. A component that is missing while others go on is read off that curve, with the error that such curves have
over stretches of this length where the component was measured.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.initialization import SAMPLES
from ftproc.core.filtering.records import FilterRun, Model, Observations, Start
from ftproc.core.filtering.smoother import SmootherRun
from ftproc.core.model import kinematics
from ftproc.core.model.frames import line_of_sight_axes, to_cartesian, wrap

FloatArray = NDArray[np.float64]
Run = TypeVar("Run", FilterRun, SmootherRun)

NEAREST = 0.2  # of the range on the nearer side of a gap: no curve comes closer
STEEPEST = 0.49 * np.pi  # rad, of a curve's elevation
BLIND = 0.5  # of a gap, in which a component that is missing has no reading
WINDOWS, PLACES = 40, np.arange(1, 8) / 8  # stretches, and where in them, that tell the error of a curve
SEEN = 0.5  # of the readings of such a stretch that are good
SIDE, EDGE, OFF = 0.125, 3, 10.0  # of its length, on either side, in which its slopes are taken, without so many
# readings, which are rejected with the gap if they are so many sigmas off
HALVINGS, GROWTH = 4, 2.5  # of its length, where the log has none so long, and the power with which the error grows


class Bridged(NamedTuple):
    """The log with curves, the model with a jerk in the gaps that is no wilder than elsewhere, and the starts that are
    left. read (n, 3): readings that are those of curves. error (n, 3, 3): 1-sigma of these, m, rad, rad, of their rates
    and of the changes of those; zero elsewhere. measurement (n, 3): what was measured."""

    log: Observations
    model: Model
    starts: list[Start]
    read: NDArray[np.bool_]
    error: FloatArray
    measurement: FloatArray

    def filtered(self, run: FilterRun) -> FilterRun:
        """A run over the log, as one of what was measured."""
        if not self.read.any():
            return run
        innovation, weight = run.innovation + self._off(), np.where(self.read, 0.0, run.weight)
        return self._widened(run._replace(innovation=innovation, weight=weight))

    def smoothed(self, run: SmootherRun) -> SmootherRun:
        """The same of the smoother."""
        return self._widened(run._replace(residual=run.residual + self._off())) if self.read.any() else run

    def _off(self) -> FloatArray:
        """(n, 3) by which what was measured lies off the curves; NaN where nothing was."""
        off = self.measurement - self.log.measurement
        off[:, 1] = wrap(off[:, 1])
        return np.where(self.read, off, 0.0)

    def _widened(self, run: Run) -> Run:
        """With sigmas that allow for the errors of the curves."""
        position, sigma, los_sigma = run.state[:, :3], run.sigma.copy(), run.los_sigma.copy()
        scale = np.stack([np.ones(len(position)), np.hypot(*position[:, :2].T), np.linalg.norm(position, axis=1)], 1)
        size, sight = self.error * scale[:, :, None], line_of_sight_axes(position)
        for k, axes in enumerate((slice(0, 3), slice(3, 6), slice(6, 9))):
            sigma[:, axes] = np.sqrt(sigma[:, axes] ** 2 + np.einsum("nci,nc->ni", sight**2, size[:, :, k] ** 2))
        for k, lines in enumerate((slice(0, 3), slice(3, 6))):
            los_sigma[:, lines] = np.hypot(los_sigma[:, lines], size[:, :, k])
        path_sigma = kinematics.widened(run.state, run.path_sigma, run.sigma, sigma)
        return run._replace(sigma=sigma, los_sigma=los_sigma, path_sigma=path_sigma)


def none(log: Observations, model: Model, starts: list[Start]) -> Bridged:
    """The log as it is."""
    n = len(log.time_s)
    return Bridged(log, model, starts, np.zeros((n, 3), bool), np.zeros((n, 3, 3)), log.measurement)


def bridged(log: Observations, model: Model, starts: list[Start]) -> Bridged:
    """The log of one station with curves through the gaps before its later starts."""
    good, found = (log.weight > 0) & np.isfinite(log.measurement), none(log, model, starts)
    if len(starts) < 2 or log.sites is not None:
        return found
    z, about = log.measurement.copy(), np.full(good.shape, np.nan)
    noise, kept, gaps = np.sqrt(model.noise_variance), starts[:1], list[Gap]()
    light = np.zeros(good.shape)  # weights of the readings of curves
    for start, stop in zip(starts[1:], [*(each.sample for each in starts[2:]), len(log.time_s)], strict=True):
        gap = _gap(log, good, kept[-1].sample, start.sample, stop)
        if gap is not None and gap.curved:
            good &= ~_edges(log, good, gap, noise)
            gap = _gap(log, good, kept[-1].sample, start.sample, stop)
        errors = None if gap is None else [_error(log, good[:, c], gap, c) for c in gap.curved]
        empty = gap is None or gap.b == gap.a + 1  # without a sample that could be estimated
        if gap is None or errors is None or empty or not all(np.isfinite(each).all() for each in errors):
            kept = [*kept, start]
            continue
        places = _curve(log, good, gap)
        about[gap.a + 1 : gap.settled] = to_cartesian(places)
        gaps.append(gap)
        for c, error in zip(gap.curved, errors, strict=True):
            found.read[gap.inside, c], found.error[gap.inside, c] = True, error
            z[gap.inside, c] = places[: gap.b - gap.a - 1, c]
            light[gap.inside, c] = (noise[c] / np.maximum(error[:, 0], noise[c])) ** 2
    if log.uneven is not None:
        light *= log.uneven.times
    weight = np.where(found.read, light, log.weight * good)
    filled = log._replace(measurement=z, weight=weight, about=about)
    return found._replace(log=filled, model=model._replace(jerk=_calm(model, log.time_s, gaps)), starts=kept)


class Gap(NamedTuple):
    """The last sample before a gap and the first after it; from which sample on the track is known again; and the
    components that curves stand for: those without a reading in most of it, if others have some."""

    a: int
    b: int
    settled: int
    curved: list[int]

    @property
    def inside(self) -> slice:
        return slice(self.a + 1, self.b)

    def span_s(self, time_s: FloatArray) -> float:
        return float(time_s[self.b] - time_s[self.a])

    def share(self, time_s: FloatArray) -> FloatArray:
        """(m,) of the gap that has passed at each of its samples."""
        found: FloatArray = (time_s[self.inside] - time_s[self.a]) / self.span_s(time_s)
        return found


def _gap(log: Observations, good: NDArray[np.bool_], first: int, sample: int, stop: int) -> Gap | None:
    """The gap before a start, between another one and the next; None without readings of all components on both
    sides."""
    before = [first + np.flatnonzero(good[first:sample, c]) for c in range(3)]
    after = [sample + np.flatnonzero(good[sample:stop, c])[:SAMPLES] for c in range(3)]
    if not all(len(each) for each in (*before, *after)):
        return None
    last, time_s = [int(each[-1]) for each in before], log.time_s
    gap = Gap(min(last), sample, 1 + max(int(each[-1]) for each in after), [])
    unseen = [float(time_s[sample] - time_s[each]) for each in last]
    blind = [c for c in range(3) if unseen[c] > BLIND * gap.span_s(time_s)]
    return gap if len(blind) == 3 else gap._replace(curved=blind)


def _hermite(share: FloatArray, ends: FloatArray, slopes: FloatArray) -> FloatArray:
    """(m,) the cubic between two ends (2,) with slopes (2,) over the whole, at shares (m,) of it."""
    u = share
    near, far = 2 * u**3 - 3 * u**2 + 1, 3 * u**2 - 2 * u**3
    found: FloatArray = near * ends[0] + far * ends[1] + (u**3 - 2 * u**2 + u) * slopes[0] + (u**3 - u**2) * slopes[1]
    return found


def _parabola(t: FloatArray, value: FloatArray, at: int, side: int, span_s: float) -> np.polynomial.Polynomial | None:
    """The parabola of a component about one of its readings, through those before it (side -1) or after it, for so long
    or at least SAMPLES, without the nearest: they may be an end of what was rejected. None with too few."""
    if side < 0:
        last = max(at + 1 - EDGE, 0)
        near = slice(max(min(int(np.searchsorted(t, t[at] - span_s)), last - SAMPLES), 0), last)
    else:
        near = slice(at + EDGE, max(int(np.searchsorted(t, t[at] + span_s)), at + EDGE + SAMPLES))
    times, values = t[near] - t[at], value[near]
    if len(times) < SAMPLES or not np.ptp(times) > 0:
        return None
    return np.polynomial.Polynomial.fit(times, values, 2)


def _end(t: FloatArray, value: FloatArray, at: int, side: int, span_s: float) -> tuple[float, float]:
    """Value and slope of a component at one of its readings, by the parabola on one side."""
    curve = _parabola(t, value, at, side, span_s)
    return (float(value[at]), 0.0) if curve is None else (float(curve(0.0)), float(curve.deriv()(0.0)))


def _edges(log: Observations, good: NDArray[np.bool_], gap: Gap, noise: FloatArray) -> NDArray[np.bool_]:
    """(n, 3) readings beside a gap that lie off the parabola of those farther away: they belong to what was rejected in
    it."""
    found = np.zeros(good.shape, bool)
    for c in gap.curved:
        (t, value), rows = _readings(log, good[:, c], c), np.flatnonzero(good[:, c])
        last, first = int((rows <= gap.a).sum()) - 1, int((rows < gap.b).sum())
        for at, side in ((last, -1), (first, 1)):
            curve = _parabola(t, value, at, side, SIDE * gap.span_s(log.time_s))
            if curve is None:
                continue
            beside = np.arange(at, at + side * EDGE, side)
            off = np.abs(value[beside] - curve(t[beside] - t[at]))
            found[rows[beside], c] = off > OFF * max(noise[c], float(np.abs(off).min()))
    return found


def _through(t: FloatArray, value: FloatArray, ends: tuple[int, int], share: FloatArray) -> FloatArray:
    """(m,) the curve between two readings of a component, at shares of the time between them."""
    a, b = ends
    span = float(t[b] - t[a])
    (from_, rate), (to, rate_there) = (_end(t, value, k, side, SIDE * span) for k, side in ((a, -1), (b, 1)))
    return _hermite(share, np.array([from_, to]), span * np.array([rate, rate_there]))


def _readings(log: Observations, good: NDArray[np.bool_], c: int) -> tuple[FloatArray, FloatArray]:
    """Times and values of the good readings of a component."""
    value = log.measurement[good, c]
    return log.time_s[good], np.unwrap(value) if c == 1 else value


def _curve(log: Observations, good: NDArray[np.bool_], gap: Gap) -> FloatArray:
    """(m, 3) range, azimuth and elevation from a gap on until the track is known again: curves, and what is
    measured."""
    found, rows = np.empty((gap.settled - gap.a - 1, 3)), slice(gap.a + 1, gap.settled)
    for c in range(3):
        t, value = _readings(log, good[:, c], c)
        found[:, c] = np.interp(log.time_s[rows], t, value)
        if c in gap.curved:
            last, first = int((t <= log.time_s[gap.a]).sum()) - 1, int((t < log.time_s[gap.b]).sum())
            share = np.clip((log.time_s[gap.inside] - t[last]) / (t[first] - t[last]), 0.0, 1.0)
            found[: len(share), c] = _through(t, value, (last, first), share)
            least = NEAREST * min(value[last], value[first])
            found[:, c] = np.maximum(found[:, c], least) if c == 0 else found[:, c]
    found[:, 2] = np.clip(found[:, 2], -STEEPEST, STEEPEST)
    return found


def _error(log: Observations, good: NDArray[np.bool_], gap: Gap, c: int) -> FloatArray:
    """(m, 3) 1-sigma of the curve of a component in a gap, of its slope and bend, by curves over stretches of this
    length that were seen; infinite where there is none."""
    (t, value), span = _readings(log, good, c), gap.span_s(log.time_s)
    usual = float(np.median(np.diff(t)))
    for halving in range(HALVINGS):
        length = span / 2**halving
        first = np.flatnonzero(t + length <= t[-1])
        last = np.searchsorted(t, t[first] + length)
        whole = (last - first) * usual > SEEN * length
        first, last = first[whole], last[whole]
        if len(first) == 0:
            continue
        some = np.unique(np.linspace(0, len(first) - 1, WINDOWS).astype(int))
        off = np.zeros((len(some), len(PLACES) + 2))
        for row, (i, j) in zip(off, zip(first[some], last[some], strict=True), strict=True):
            at = t[i] + PLACES * (t[j] - t[i])
            row[1:-1] = np.interp(at, t[i : j + 1], value[i : j + 1]) - _through(t, value, (i, j), PLACES)
        off *= 2 ** (GROWTH * halving)
        slope = np.gradient(off, span * PLACES[0], axis=1)
        bend = np.gradient(slope, span * PLACES[0], axis=1)
        sizes = (np.sqrt(np.mean(np.square(each), 0)) for each in (off, slope, bend))
        return np.stack([np.interp(gap.share(log.time_s), [0.0, *PLACES, 1.0], each) for each in sizes], 1)
    return np.full((gap.b - gap.a - 1, 3), np.inf)


def _calm(model: Model, time_s: FloatArray, gaps: list[Gap]) -> FloatArray:
    """(m, 3) the jerk profile without what the lost track asked for in the gaps and beside them."""
    inside = np.zeros(len(model.jerk), bool)
    for gap in gaps:
        first, last = ((time_s[k] - time_s[0]) / model.knot_s for k in (gap.a, gap.settled - 1))
        inside[max(int(first) - 1, 0) : int(last) + 2] = True
    if not inside.any() or inside.all():
        return model.jerk
    return np.where(inside[:, None], np.minimum(model.jerk, np.median(model.jerk[~inside], 0)), model.jerk)
