"""Over gaps that are too long to bridge, both sides say about which places readings are linearised.

A filter that coasts until the target may be anywhere linearises about a wrong place, and then takes its own error for
a measurement: with angles alone the target runs away, or turns back to the station where all motion costs little; with
the range alone it circles. So it is started again after such a gap (`initialization`). The whole record knows where the
target came out of it. About a curve through the gap all is linear: the track is one, and its sigmas are those of the
motion. A component that is missing while others go on is read off that curve now and then, with the error that such
curves have over stretches of this length where the component was measured.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.forward import filter_log
from ftproc.core.filtering.initialization import SAMPLES
from ftproc.core.filtering.records import FilterRun, Model, Observations, Start
from ftproc.core.filtering.smoother import SmootherRun, smooth_log
from ftproc.core.model import kinematics
from ftproc.core.model.frames import from_cartesian, line_of_sight_axes, to_cartesian, wrap

FloatArray = NDArray[np.float64]
Run = TypeVar("Run", FilterRun, SmootherRun)

NEAREST = 0.2  # of the range on the nearer side of a gap: no curve comes closer
STEEPEST = 0.49 * np.pi  # rad, of a curve's elevation
BLIND = 0.5  # of a gap, in which a component that is missing has no reading
WINDOWS, PLACES = 40, np.arange(1, 8) / 8  # stretches, and where in them, that tell the error of a curve
SEEN = 0.5  # of the readings of such a stretch that are good
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
        """A run over the log, with the innovations of what was measured."""
        if not self.read.any():
            return run
        off = self.measurement - self.log.measurement
        off[:, 1] = wrap(off[:, 1])
        innovation = run.innovation + np.where(self.read, off, 0.0)
        return self.widened(run._replace(innovation=innovation, weight=np.where(self.read, 0.0, run.weight)))

    def widened(self, run: Run) -> Run:
        """A run over the log, with sigmas that allow for the errors of the curves."""
        if not self.read.any():
            return run
        position, sigma, los_sigma = run.state[:, :3], run.sigma.copy(), run.los_sigma.copy()
        scale = np.stack([np.ones(len(position)), np.hypot(*position[:, :2].T), np.linalg.norm(position, axis=1)], 1)
        size, sight = self.error * scale[:, :, None], line_of_sight_axes(position)
        for k, axes in enumerate((slice(0, 3), slice(3, 6), slice(6, 9))):
            sigma[:, axes] = np.sqrt(sigma[:, axes] ** 2 + np.einsum("nci,nc->ni", sight**2, size[:, :, k] ** 2))
        for k, lines in enumerate((slice(0, 3), slice(3, 6))):
            los_sigma[:, lines] = np.hypot(los_sigma[:, lines], size[:, :, k])
        path_sigma = kinematics.widened(run.state, run.path_sigma, run.sigma, sigma)
        return run._replace(sigma=sigma, los_sigma=los_sigma, path_sigma=path_sigma)


def bridged(log: Observations, model: Model, starts: list[Start]) -> Bridged:
    """The log of one station with curves through the gaps before its later starts."""
    good = (log.weight > 0) & np.isfinite(log.measurement)
    found = Bridged(log, model, starts, np.zeros(good.shape, bool), np.zeros((*good.shape, 3)), log.measurement)
    if len(starts) < 2 or log.sites is not None:
        return found
    before, after = filter_log(log, model, starts).state, smooth_log(log, model, starts).state
    z, weight, about = log.measurement.copy(), log.weight.copy(), np.full(good.shape, np.nan)
    noise, kept = np.sqrt(model.noise_variance), starts[:1]
    for start, stop in zip(starts[1:], [*(each.sample for each in starts[2:]), len(log.time_s)], strict=True):
        gap = _gap(log, good, kept[-1].sample, start.sample, stop)
        errors = None if gap is None else [_error(log, good[:, c], after, gap, c) for c in gap.blind]
        if gap is None or errors is None or not np.isfinite(errors).all():
            kept = [*kept, start]
            continue
        places = _curve(log, good, gap, before, after)
        about[gap.inside], about[gap.b : gap.settled] = places, after[gap.b : gap.settled, :3]
        if len(gap.blind) < 3:
            for c, error in zip(gap.blind, errors, strict=True):
                found.read[gap.inside, c], found.error[gap.inside, c] = True, error
                z[gap.inside, c] = from_cartesian(places)[:, c]
                weight[gap.inside, c] = (noise[c] / np.maximum(error[:, 0], noise[c])) ** 2
    if log.uneven is not None:
        weight = np.where(found.read, weight * log.uneven.times, weight)
    filled = log._replace(measurement=z, weight=weight, about=about)
    return found._replace(log=filled, model=model._replace(jerk=_calm(model, log.time_s, about)), starts=kept)


class Gap(NamedTuple):
    """The last sample before a gap and the first after it; from which sample on the track is known again; and the
    components without a reading in most of it."""

    a: int
    b: int
    settled: int
    blind: list[int]

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
    return gap._replace(blind=[c for c in range(3) if unseen[c] > BLIND * gap.span_s(time_s)])


def _hermite(share: FloatArray, ends: FloatArray, slopes: FloatArray) -> FloatArray:
    """The cubic between two ends (2, ...) with slopes (2, ...) over the whole, at shares (m,) of it: (m, ...)."""
    u = share.reshape(-1, *(1,) * (ends.ndim - 1))
    near, far = 2 * u**3 - 3 * u**2 + 1, 3 * u**2 - 2 * u**3
    found: FloatArray = near * ends[0] + far * ends[1] + (u**3 - 2 * u**2 + u) * slopes[0] + (u**3 - u**2) * slopes[1]
    return found


def _curve(log: Observations, good: NDArray[np.bool_], gap: Gap, before: FloatArray, after: FloatArray) -> FloatArray:
    """(m, 3) m: places in a gap, by the states (n, 9) on both sides; with what is measured there, if something is."""
    ends, span, share = np.stack([before[gap.a], after[gap.b]]), gap.span_s(log.time_s), gap.share(log.time_s)
    if len(gap.blind) == 3:
        return _hermite(share, ends[:, :3], span * ends[:, 3:6])
    value, rate = _polar(ends)
    value[:, 1] = np.unwrap(value[:, 1])
    found = _hermite(share, value, span * rate)
    for c in {0, 1, 2}.difference(gap.blind):
        seen = gap.a + np.flatnonzero(good[gap.a : gap.b + 1, c])
        measured = log.measurement[seen, c]
        found[:, c] = np.interp(log.time_s[gap.inside], log.time_s[seen], np.unwrap(measured) if c == 1 else measured)
    found[:, 0] = np.maximum(found[:, 0], NEAREST * value[:, 0].min())
    found[:, 2] = np.clip(found[:, 2], -STEEPEST, STEEPEST)
    return to_cartesian(found)


def _polar(state: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n, 3) range, azimuth and elevation of states (n, 9), and their rates."""
    (x, y, z), (u, v, w) = state[:, :3].T, state[:, 3:6].T
    ground = np.maximum(np.hypot(x, y), 1e-9)
    slant = np.hypot(ground, z)
    away = (x * u + y * v) / ground
    rates = (x * u + y * v + z * w) / slant, (x * v - y * u) / ground**2, (w * ground - z * away) / slant**2
    return from_cartesian(state[:, :3]), np.stack(rates, 1)


def _error(log: Observations, good: NDArray[np.bool_], state: FloatArray, gap: Gap, c: int) -> FloatArray:
    """(m, 3) 1-sigma of the curve of a component in a gap, of its slope and bend, by curves over stretches of this
    length that were seen."""
    seen = np.flatnonzero(good)
    t, value, (_, rates) = log.time_s[seen], log.measurement[seen, c], _polar(state[seen])
    value, rate, span = np.unwrap(value) if c == 1 else value, rates[:, c], gap.span_s(log.time_s)
    usual = float(np.median(np.diff(t)))
    for halving in range(HALVINGS):
        length = span / 2**halving
        first = np.flatnonzero(t + length <= t[-1])
        last = np.searchsorted(t, t[first] + length)
        last = np.minimum(last, len(t) - 1)
        whole = (last - first) * usual > SEEN * length
        first, last = first[whole], last[whole]
        if len(first) == 0:
            continue
        some = np.unique(np.linspace(0, len(first) - 1, WINDOWS).astype(int))
        off = []
        for i, j in zip(first[some], last[some], strict=True):
            at = t[i] + PLACES * (t[j] - t[i])
            curve = _hermite(PLACES, value[[i, j]], (t[j] - t[i]) * rate[[i, j]])
            off.append(np.interp(at, t[i : j + 1], value[i : j + 1]) - curve)
        ends = np.zeros((len(off), 1))
        error = 2 ** (GROWTH * halving) * np.hstack([ends, off, ends])
        slope = np.gradient(error, span * PLACES[0], axis=1)
        bend = np.gradient(slope, span * PLACES[0], axis=1)
        sizes = (np.sqrt(np.mean(np.square(each), 0)) for each in (error, slope, bend))
        return np.stack([np.interp(gap.share(log.time_s), [0.0, *PLACES, 1.0], each) for each in sizes], 1)
    return np.full((gap.b - gap.a - 1, 3), np.inf)


def _calm(model: Model, time_s: FloatArray, about: FloatArray) -> FloatArray:
    """(m, 3) the jerk profile without what the lost track asked for."""
    rows = np.isfinite(about[:, 0])
    knot = np.minimum(((time_s[rows] - time_s[0]) / model.knot_s).astype(int), len(model.jerk) - 1)
    jerk, inside = model.jerk.copy(), np.zeros(len(model.jerk), bool)
    inside[knot] = True
    if inside.any() and not inside.all():
        jerk[inside] = np.minimum(jerk[inside], np.median(jerk[~inside], 0))
    return jerk
