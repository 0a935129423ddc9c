"""Readings of a component that have jumped beside the track and go on there, as after a slip of an encoder.

A run of rejected readings may have a constant offset. Then they tell how the target moves all the same: the offset is
taken out of them, and of those that follow, until they are back. The sigmas allow for its uncertain size. Were they
left out, the track would lose sight of the target, and follow them in the end.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.editing import patch_likelihood
from ftproc.core.editing.lasting.curves import Curve, Fitted, Setting, columns_of, fitted
from ftproc.core.editing.lasting.faults import Shift, allowing
from ftproc.core.filtering.columns import said_of
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import RESIDUALS, smooth_log
from ftproc.core.identification.profile import roughness
from ftproc.core.identification.scales import Scales
from ftproc.core.live.newest.readmission import FEWER, Open, Other, log_probability, moving, rejected
from ftproc.core.model.frames import line_of_sight_axes, wrap
from ftproc.order_statistics import median
from ftproc.records import FloatArray, IntArray

WELL = 3.0  # sigmas of the noise, as 1-sigma of a jump that is taken out (tracks that followed a patch: up to 286)
NEARLY = 0.5  # of what the readings were off, within which they are back (another target that moves: 5.9 to 2.0 m)
JUMPED, BACK = 4, 2  # readings in a row that show it
FASTEST = 1e3  # 1/s, of the growth of an offset
SHORTEST, LONGER = 8, math.sqrt(2)  # readings of an earlier patch that is tried, and times as many in the next
LIKELIEST = 3  # of these, before the process noise follows, that are weighed with it (of 12 dense flights two are worse
# with one, none with three)
NEARLY_WHOLE = 1e-9  # powers of LONGER are rounded


@np.errstate(all="ignore")  # where times stand still numbers may overflow; what comes of it has no gain
def likeliest(case: Open) -> tuple[Open, float] | None:
    """The case if the newest readings of a component are off by a constant, or by none any more, and the gain in
    log-probability; the likeliest of such."""
    tried = list[tuple[Open, float]]()
    runs = {c: run for c in range(3) if len(run := rejected(case, c)) >= BACK}
    if not runs:
        return None
    smoothed = smooth_log(case.log, case.model, [case.start], RESIDUALS)
    for c, run in runs.items():
        sigma = math.sqrt(case.model.reading_variance[c])
        off = smoothed.residual[run, c]
        if case.level[-1, c] != 0:
            within = patch_likelihood.OFF_CURVE * math.hypot(sigma, case.level_sigma[-1, c])
            back = run[np.abs(off + case.level[-1, c]) <= within]
            if len(back) >= BACK:
                tried.append(_back(case, c, back))
            tried += _was_a_patch(case, c, run)
        if len(run) >= JUMPED:
            away = np.abs(off - median(off))
            together = run[away <= max(patch_likelihood.OFF_CURVE * sigma, 2.5 * median(away))]
            if len(together) >= JUMPED:
                jump, patches = (
                    [*_well_known(case, c, _nearly_back(case, c, together, *_jumped(case, c, together)))],
                    list(_earlier_patches(case, c, run)),
                )
                tried += [*_over(jump, patches, odds.POSSIBLE), *_over(patches, jump)]
    found = [(_with_others(case, other), gain) for other, gain in tried if math.isfinite(gain)]
    return max(found, key=lambda each: each[1], default=None)


def _with_others(case: Open, other: Open) -> Open:
    """Where readings of a component are back, those of others are that have jumped with them, as another target has."""
    back = (case.level[-1] != 0) & (other.level[-1] == 0)
    for c, d in itertools.product(np.flatnonzero(back), np.flatnonzero(other.level[-1] != 0)):
        if _begin(case, int(c)) == _begin(case, int(d)):
            since = int(np.flatnonzero(other.log.weight[:, c] > case.log.weight[:, c])[0])
            run = since + np.flatnonzero(case.possible[since:, d])
            other = _off_the_track(other, int(d), run, abs(float(case.level[-1, d]))) if len(run) else other
    return other


def _begin(case: Open, c: int) -> int:
    """The first sample of the stretch in which the newest reading of a component lies, where that has a level."""
    none = np.flatnonzero(case.level[:, c] == 0)
    return int(none[-1]) + 1 if len(none) else 0


def _over(
    some: list[tuple[Open, float]], others: list[tuple[Open, float]], by: float = 0.0
) -> list[tuple[Open, float]]:
    """Some cases with their gains over the likeliest of others, and so much more."""
    rival = max([0.0, *(gain + by for _, gain in others)])
    return [(case, gain - rival) for case, gain in some]


def _well_known(case: Open, c: int, jumped: tuple[Open, float]) -> Iterator[tuple[Open, float]]:
    """A jump from a track that was known about as well as readings tell; one that followed a patch seldom is."""
    if jumped[0].level_sigma[-1, c] < WELL * math.sqrt(case.model.reading_variance[c]):
        yield jumped


def _jumped(case: Open, c: int, run: IntArray) -> tuple[Open, float]:
    """The readings of a run have jumped, and all that follow."""
    jump, likely = _with_jump(case, case.log.measurement, c, run)
    level, sigma = case.level.copy(), case.level_sigma.copy()
    level[run[0] :, c] += jump.curves[0].size[0]
    sigma[run[0] :, c] = np.sqrt(sigma[run[0] :, c] ** 2 + jump.covariance[0, 0])
    return _levelled(case, run, c, level, sigma), likely - log_probability(case, case.log.weight)


def _nearly_back(case: Open, c: int, run: IntArray, jumped: Open, gain: float) -> tuple[Open, float]:
    """The readings that have jumped once more are back if they are much nearer than before, as another target moves:
    then the track has drifted with them, by what they are off now."""
    before, now = case.level[-1, c], jumped.level[-1, c]
    if not abs(now) < NEARLY * abs(before):
        return jumped, gain
    return _off_the_track(case, c, run, abs(float(now))), gain


def _off_the_track(case: Open, c: int, run: IntArray, drift: float) -> Open:
    """The readings of a run are back, and what has jumped before does not count; the track may have drifted by so much
    with it."""
    level, sigma, possible = case.level.copy(), case.level_sigma.copy(), case.possible.copy()
    begin, since = _begin(case, c), int(run[0])
    level[begin:, c] = sigma[begin:, c] = 0.0
    possible[begin:since, c] = False
    back = _levelled(case, run, c, level, sigma)._replace(possible=possible)
    back.log.weight[begin:since, c] = 0.0
    if begin > 0:
        return back
    time_s = case.log.time_s
    return back._replace(start=_widened(case.start, c, drift, 1 / max(time_s[since] - time_s[0], 1e-300)))


def _with_jump(case: Open, measurement: FloatArray, c: int, run: IntArray, about: float = 0.0) -> tuple[Fitted, float]:
    """A constant for what a run is off by, which is about so much, and the log-probability of all readings with it."""
    log = case.log._replace(measurement=measurement, weight=_used(case, run, c))
    n = len(log.time_s)
    curve, setting = Curve(c, int(run[0]), n, (about,)), Setting(log.time_s, np.zeros((n, 3)))
    jump = fitted(log, case.model, [case.start], setting, [curve])
    begins, stays = case.rates[c, 1:].tolist()
    there = math.log(begins) + len(run) * math.log(stays)
    return jump, jump.log_probability + there + _rejections(case, jump.log)


def _back(case: Open, c: int, run: IntArray) -> tuple[Open, float]:
    """Nothing is to be taken out of the readings of a run any more; which tells what was to be before."""
    log, n = case.log._replace(weight=_used(case, run, c)), len(case.log.time_s)
    level, variance = case.level[-1, c], case.level_sigma[-1, c] ** 2
    curve = Curve(c, int(run[0]), n, (0.0,))
    said = said_of(log, case.model, [case.start], columns_of([curve], Setting(log.time_s, np.zeros((n, 3)))))
    score, information = said.score[0], said.information[0, 0]
    left = score + information * level  # by which the offset is less than the level, within its sigma
    likely = said.log_likelihood - score * level - 0.5 * information * level**2
    likely += 0.5 * left**2 / (information + 1 / variance) - 0.5 * np.log1p(information * variance)
    gain = likely + _rejections(case, log) - log_probability(case, case.log.weight)
    levels, sigma, begin = case.level.copy(), case.level_sigma.copy(), _begin(case, c)
    levels[begin:, c] -= left / (information + 1 / variance)
    levels[run[0] :, c] = sigma[run[0] :, c] = 0.0
    start = case.start if begin > 0 else _widened(case.start, c, float(np.sqrt(variance)))
    return _levelled(case, run, c, levels, sigma)._replace(start=start), gain


def _was_a_patch(case: Open, c: int, run: IntArray) -> Iterator[tuple[Open, float]]:
    """The readings that have jumped were a patch with more than an offset."""
    begin = _begin(case, c)
    jumped = begin + np.flatnonzero(case.log.weight[begin:, c] > 0)
    if begin > 0 and len(jumped):
        raw = case.log.measurement.copy()
        raw[begin:, c] += case.level[begin:, c]
        _, now = _with_jump(case, raw, c, jumped, float(case.level[-1, c]))
        yield from ((other, likely - now) for other, likely in _without(case, c, jumped, run))


def hindsight(case: Open, profile: Model, scales: Scales, fresh: int) -> Other | None:
    """What more readings tell by now of what has jumped: nothing has, but the target begins to move; or the track
    has followed a patch until then. Each with the process noise for it, and the gain in log-probability. fresh: how
    many samples are new; it is weighed where there are half as many again as the last time, or so."""
    found = list[Other]()
    for c in np.flatnonzero(case.level[-1] != 0):
        begin = _begin(case, int(c))
        jumped = begin + np.flatnonzero(case.log.weight[begin:, c] > 0)
        age = len(case.log.time_s) - begin
        if begin > 0 and len(jumped) and _times(age) > _times(max(age - fresh, 1)):
            found += _as_it_came(case, int(c), jumped, profile, scales)
    return max(found, key=lambda each: each.gain, default=None)


def _times(samples: int) -> int:
    """How many times LONGER one must be for so many samples."""
    return int(math.log(samples) / math.log(LONGER) + NEARLY_WHOLE)


def _as_it_came(case: Open, c: int, jumped: IntArray, profile: Model, scales: Scales) -> Iterator[Other]:
    """The readings of a component that have jumped are right as they came, where those before are, or the last of
    them were a patch: the likeliest of these."""
    begin, level, sigma = _begin(case, c), case.level.copy(), case.level_sigma.copy()
    level[begin:, c] = sigma[begin:, c] = 0.0
    none = _levelled(case, np.r_[jumped, rejected(case, c)], c, level, sigma)
    _, now = _with_jump(case, none.log.measurement, c, jumped, float(case.level[-1, c]))
    patches = [_left_out(none, off, c) for off in _last_ones(np.flatnonzero(case.log.weight[:begin, c] > 0))]
    patches.sort(key=lambda each: -log_probability(each[0], each[0].log.weight))
    for other, possible in ((none, case.possible), *patches[:LIKELIEST]):
        found = moving(other, profile, scales, now - roughness(case.model), FEWER)
        yield found._replace(case=found.case._replace(possible=possible))


def _left_out(case: Open, off: IntArray, c: int) -> tuple[Open, NDArray[np.bool_]]:
    """Some readings were a patch; and which are possible then."""
    weight, possible = case.log.weight.copy(), case.possible.copy()
    weight[off, c], possible[off, c] = 0.0, False
    return case._replace(log=case.log._replace(weight=weight)), possible


def _last_ones(good: IntArray) -> Iterator[IntArray]:
    """The last of some samples, more and more of them."""
    length = float(SHORTEST)
    while length < len(good):
        yield good[-int(length) :]
        length *= LONGER


def _without(case: Open, c: int, off: IntArray, run: IntArray) -> Iterator[tuple[Open, float]]:
    """Some readings were a patch and do not count, and those of a run are good beside a track without them; and how
    likely that is."""
    possible, level, sigma = case.possible.copy(), case.level.copy(), case.level_sigma.copy()
    possible[off, c] = False
    begin = _begin(case, c)
    level[begin:, c] = sigma[begin:, c] = 0.0
    none = _levelled(case, run[:0], c, level, sigma)
    weight = none.log.weight.copy()
    weight[off, c] = 0.0
    none = none._replace(log=none.log._replace(weight=weight))
    smoothed = smooth_log(none.log, case.model, [case.start], RESIDUALS)
    spread = np.sqrt(smoothed.residual_variance[run, c])
    back = run[np.abs(smoothed.residual[run, c]) <= patch_likelihood.OFF_CURVE * spread]
    if len(off) and len(back) >= BACK:
        other = none._replace(log=none.log._replace(weight=_used(none, back, c)))
        yield other._replace(possible=possible), log_probability(other, other.log.weight)


def _earlier_patches(case: Open, c: int, run: IntArray) -> Iterator[tuple[Open, float]]:
    """The readings before a run were a patch, which the track has followed."""
    now, good = log_probability(case, case.log.weight), np.flatnonzero(case.log.weight[:, c] > 0)
    for off in _last_ones(good) if case.level[-1, c] == 0 else ():
        yield from ((other, likely - now) for other, likely in _without(case, c, off, run))


def _levelled(case: Open, run: IntArray, c: int, level: FloatArray, sigma: FloatArray) -> Open:
    """With other levels taken out of the readings, and those of a run used."""
    z = case.log.measurement + case.level - level
    z[:, 1] = wrap(z[:, 1])
    log = case.log._replace(measurement=z, weight=_used(case, run, c))
    return case._replace(log=log, level=level, level_sigma=sigma)


def _used(case: Open, run: IntArray, c: int) -> FloatArray:
    """The decisions (n, 3), with a run good."""
    weight = case.log.weight.copy()
    weight[run, c] = 1.0
    return weight


def _rejections(case: Open, log: Observations) -> float:
    smoothed = smooth_log(log, case.model, [case.start], RESIDUALS)
    return patch_likelihood.log_probability_of_all(
        log.time_s, smoothed.residual, smoothed.residual_variance, log.weight, case.possible,
        case.model.reading_variance, case.rates,
    )  # fmt: skip


def _widened(start: Start, c: int, sigma: float, rate: float = 0.0) -> Start:
    """A start that allows for an offset of a component with this 1-sigma, which has grown at a rate, per s."""
    x, covariance = start.state, start.covariance.copy()
    length = (1.0, float(np.hypot(x[0], x[1])), float(np.linalg.norm(x[:3])))[c]
    moves = line_of_sight_axes(x[None, :3])[0, c] * length * sigma
    covariance[:3, :3] += np.outer(moves, moves)
    covariance[3:6, 3:6] += np.outer(moves, moves) * min(rate, FASTEST) ** 2
    return start._replace(covariance=covariance)


def widen(found: Any, level: FloatArray, sigma: FloatArray) -> None:
    """Let the sigmas of rows or of a smoothed log allow for the sizes of levels (n, 3) with these 1-sigmas."""
    if sigma.any():
        shifts = list(_shifts(level, sigma))
        found.sigma[:], found.los_sigma[:] = allowing(found.state, found.sigma, found.los_sigma, shifts)


def _shifts(level: FloatArray, sigma: FloatArray) -> Iterator[Shift]:
    """What is taken out of readings, from the offsets and their 1-sigmas (n, 3)."""
    for c in np.flatnonzero(level.any(0)):
        edges = np.flatnonzero(np.diff(sigma[:, c])) + 1
        for low, high in itertools.pairwise([0, *edges.tolist(), len(sigma)]):
            if sigma[low, c] > 0:
                yield Shift(int(c), low, high, float(sigma[low, c]))
