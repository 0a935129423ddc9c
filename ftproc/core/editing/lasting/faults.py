"""What is wrong with the readings of a log beyond outliers, and what is taken out of them for it.

The levels of a component between its steps are settled together: that on which most readings lie is right, and the
others are moved to it. One log cannot show that they are all wrong.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing.copies import KindArray
from ftproc.core.editing.lasting.curves import CLOCK, Curve, Setting, fitted, without
from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.records import Model, Observations
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.identification.one_sided import OneSided
from ftproc.core.model.frames import from_cartesian, line_of_sight_axes, wrap
from ftproc.core.model.moving import between
from ftproc.order_statistics import median, medians
from ftproc.records import FloatArray, IntArray

MOST = 6  # understandings that the sigmas allow for, the likeliest
SAME = 4.5  # sigmas of the noise within which two levels are one


class Step(NamedTuple):
    """From a sample on the readings of a component (range, azimuth, elevation) are larger by `size` m, rad, rad, or,
    where it is CLOCK, their times by so many seconds. sigma: 1-sigma of the size. sure: that it is no patch; if not,
    it was left in the readings."""

    component: int
    sample: int
    size: float
    sigma: float
    sure: bool = True


class Shift(NamedTuple):
    """What was taken out of the readings [begin, end) of a component, or of the clock: a constant with this 1-sigma."""

    component: int
    begin: int
    end: int
    sigma: float


MOTION, PATCH, STEP = "motion", "a patch of outliers", "a step that stays"


class Rival(NamedTuple):
    """What the readings [begin, end) of a component were taken for, MOTION, PATCH or STEP, and what else they may be:
    that is less likely by `gain` only, in log-probability, or, below zero, likelier by what is around it, while the
    track is lost with it. step: that was taken out, or would be, if either is one."""

    component: int
    begin: int
    end: int
    gain: float
    chosen: str
    other: str
    step: Step | None = None


Lasting = TypeVar("Lasting", Shift, Rival)


class Faults(NamedTuple):
    """copied: (n, 3) kinds of the readings that were not measured, see `copies`. steps: that stay. shifts: what was
    moved for them. one_sided: components of which many errors have one sign. rivals: of what was chosen."""

    copied: KindArray
    steps: tuple[Step, ...] = ()
    shifts: tuple[Shift, ...] = ()
    one_sided: tuple[OneSided, ...] = ()
    rivals: tuple[Rival, ...] = ()

    def rows(self, low: int, high: int) -> Faults:
        """Of the samples [low, high) alone."""
        steps = tuple(s._replace(sample=s.sample - low) for s in self.steps if low <= s.sample < high)

        def inside(of: tuple[Lasting, ...]) -> tuple[Lasting, ...]:
            return tuple(
                each._replace(begin=max(each.begin, low) - low, end=min(each.end, high) - low)
                for each in of
                if each.end > low and each.begin < high
            )

        return Faults(self.copied[low:high], steps, inside(self.shifts), self.one_sided, inside(self.rivals))

    def at(self, sample: IntArray, first: IntArray) -> Faults:
        """Of rows (n,) that repeat these samples (m,); first (m + 1,): where each begins, and their number."""
        steps = tuple(s._replace(sample=int(first[s.sample])) for s in self.steps)

        def of_rows(of: tuple[Lasting, ...]) -> tuple[Lasting, ...]:
            return tuple(each._replace(begin=int(first[each.begin]), end=int(first[each.end])) for each in of)

        return Faults(self.copied[sample], steps, of_rows(self.shifts), self.one_sided, of_rows(self.rivals))


def refined(
    log: Observations, model: Model, setting: Setting, steps: Sequence[Step], first: FloatArray
) -> tuple[Observations, tuple[Step, ...], tuple[Shift, ...]]:
    """A log without its steps, those with the sizes that all the record tells, and what was moved. log: as it was
    read. first: see `taken_out`."""
    n = len(log.time_s)
    if not steps:
        return log, (), ()
    clock = [step for step in steps if step.component == CLOCK]
    on_time = taken_out(log, model, setting, levelled(log, model.noise_variance, clock), first)
    curves = [Curve(s.component, s.sample, n, (s.size,)) for s in sorted(steps, key=_when) if s.component != CLOCK]
    known = tuple(clock)
    if curves:
        rest = on_time._replace(measurement=without(on_time.measurement, setting, curves))
        starts = find_starts(rest, model.noise_variance, median(model.jerk[:, 0]))
        found = fitted(on_time, model, starts, setting, curves)
        sigma = np.sqrt(np.diag(found.covariance))
        known += tuple(
            Step(c.component, c.begin, c.size[0], float(s)) for c, s in zip(found.curves, sigma, strict=True)
        )
    moved = levelled(log, model.noise_variance, known)
    shifts = tuple(Shift(c.component, c.begin, c.end, _sigma(known, c)) for c in moved)
    return taken_out(log, model, setting, moved, first), tuple(sorted(known, key=_when)), shifts


def _when(step: Step) -> int:
    return step.sample


def taken_out(
    log: Observations, model: Model, setting: Setting, moved: Sequence[Curve], first: FloatArray
) -> Observations:
    """The log without what has to be taken out of its readings: those of a clock that is late are moved to their time
    stamps along the track that they show at the times at which they were taken. first: (n, 3) weights as they were
    decided on before: of samples that no reading was taken at, the readings count for that track all the same."""
    rest = log._replace(measurement=without(log.measurement, setting, [c for c in moved if c.component != CLOCK]))
    time_s = _taken_s(log.time_s, moved)
    late = time_s != log.time_s
    if not late.any():
        return rest
    order = np.argsort(time_s, kind="stable")
    sorted_s, level = time_s[order], model._replace(jerk=medians(model.jerk)[None], knot_s=math.inf)
    read = np.where(unseen(log.time_s, moved)[:, None], first, log.weight)
    taken = rest.part(order)._replace(time_s=sorted_s, weight=read[order])
    state = smooth_log(taken, level, find_starts(taken, model.noise_variance, float(level.jerk[0, 0]))).state
    there, here = between(sorted_s, state, log.time_s[late]), between(sorted_s, state, time_s[late])
    z = rest.measurement.copy()
    z[late] += from_cartesian(there[:, :3]) - from_cartesian(here[:, :3])
    z[:, 1] = wrap(z[:, 1])
    return rest._replace(measurement=z)


def unseen(time_s: FloatArray, moved: Sequence[Curve]) -> NDArray[np.bool_]:
    """(n,) samples with stamps before or after all times at which readings were taken."""
    taken_s = _taken_s(time_s, moved)
    found: NDArray[np.bool_] = (time_s < taken_s.min()) | (time_s > taken_s.max())
    return found


def _taken_s(time_s: FloatArray, moved: Sequence[Curve]) -> FloatArray:
    """(n,) when the readings were taken, if these jumps of the clock are taken out."""
    taken_s = time_s.copy()
    for curve in moved:
        if curve.component == CLOCK:
            taken_s[curve.rows] -= curve.size[0]
    return taken_s


def _sigma(steps: Sequence[Step], moved: Curve) -> float:
    """Of a level that was moved: of the steps at its ends."""
    return float(max(s.sigma for s in steps if s.component == moved.component and s.sample in (moved.begin, moved.end)))


def levelled(log: Observations, noise_variance: FloatArray, steps: Sequence[Step]) -> list[Curve]:
    """What has to be taken out of the readings between the steps, so that each component has one level: that of most
    readings."""
    moved: list[Curve] = []
    for component in sorted({step.component for step in steps}):
        own = sorted((s for s in steps if s.component == component), key=lambda s: s.sample)
        edges = [0, *(s.sample for s in own), len(log.time_s)]
        level = np.cumsum([0.0, *(s.size for s in own)])
        seen = np.asarray(log.weight.any(1) if component == CLOCK else log.weight[:, component] > 0)
        count = np.array([seen[a:b].sum() for a, b in itertools.pairwise(edges)])
        near = max(s.sigma for s in own) if component == CLOCK else float(np.sqrt(noise_variance[component]))
        votes = [count[np.abs(level - each) < SAME * near].sum() for each in level]
        level = level - level[int(np.argmax(votes))]
        moved += [
            Curve(component, a, b, (float(size),))
            for (a, b), size in zip(itertools.pairwise(edges), level, strict=True)
            if size != 0.0 and b > a
        ]
    return moved


def spread(state: FloatArray, shifts: Sequence[Shift]) -> tuple[FloatArray, FloatArray]:
    """(n, 3) variances, m2, that the uncertain sizes of shifts add to the positions of the states (n, 9) that were
    moved: along x, y, z, and along the radial, cross and up axes."""
    axes, lines = np.zeros((len(state), 3)), np.zeros((len(state), 3))
    for shift in shifts:
        rows = slice(shift.begin, shift.end)
        position, velocity = state[rows, :3], state[rows, 3:6]
        sight = line_of_sight_axes(position)
        slant = np.linalg.norm(position, axis=1)[:, None]
        ground = np.hypot(position[:, 0], position[:, 1])[:, None]
        moves = (sight[:, 0], sight[:, 1] * ground, sight[:, 2] * slant, velocity)[shift.component]
        axes[rows] += (moves * shift.sigma) ** 2
        lines[rows] += (np.einsum("kij,kj->ki", sight, moves) * shift.sigma) ** 2
    return axes, lines


def allowing(
    state: FloatArray, sigma: FloatArray, los_sigma: FloatArray, shifts: Sequence[Shift]
) -> tuple[FloatArray, FloatArray]:
    """Sigmas (n, 9) of states (n, 9), and (n, 6) along the lines of sight, that allow for the uncertain sizes of
    shifts."""
    along_axes, along_lines = spread(state, shifts)
    sigma, los_sigma = sigma.copy(), los_sigma.copy()
    sigma[:, :3] = np.sqrt(sigma[:, :3] ** 2 + along_axes)
    los_sigma[:, :3] = np.sqrt(los_sigma[:, :3] ** 2 + along_lines)
    return sigma, los_sigma


def others(
    read: Observations, possible: NDArray[np.bool_], model: Model, setting: Setting, steps: Sequence[Step],
    rivals: Sequence[Rival], first: FloatArray,
) -> Iterator[Observations]:  # fmt: skip
    """The log by each of some rivals. read: with the readings as they were read and the weights as decided. possible
    (n, 3): readings that may be good. steps: that were taken out. first: see `taken_out`."""
    for rival in islice(sorted(rivals, key=lambda each: each.gain), MOST):
        weight, rows = read.weight.copy(), slice(rival.begin, rival.end)
        if rival.chosen == PATCH or rival.other == PATCH:
            weight[rows, rival.component] = possible[rows, rival.component] if rival.chosen == PATCH else 0.0
        left = [each for each in steps if rival.chosen != STEP or not _same(each, rival.step)]
        if rival.other == STEP and rival.step is not None:
            left.append(rival.step)
        log = read._replace(weight=weight)
        yield taken_out(log, model, setting, levelled(log, model.noise_variance, left), first)


def _same(one: Step, other: Step | None) -> bool:
    return other is not None and (one.component, one.sample) == (other.component, other.sample)
