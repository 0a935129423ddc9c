"""A clock that jumps: from a sample on the time stamps of a station are late, and its readings are of earlier moments.

To move the readings by their rates would do for small jumps only: an agile target turns within one. So the times are
moved, and the log is put in their order.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ftproc.core.editing.lasting.curves import CLOCK, WIDE_CLOCK, Curve, Setting, columns_of
from ftproc.core.editing.lasting.scan import Jump
from ftproc.core.editing.lasting.weighing import Scene, Weighed, as_it_is, late_of, weighed
from ftproc.core.filtering.columns import said_of
from ftproc.core.filtering.records import Model
from ftproc.core.filtering.smoother import STATES, smooth_log
from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.core.model.moving import moved_to
from ftproc.records import FloatArray, IntArray

GAP = 3.0  # intervals between two samples, at least, that are a gap
COMPARED = 9  # readings after a jump that are compared with the track before it,
PLACES = 4  # in each interval of as many moments,
TRIED = 3  # of which the likeliest are tried
ROUNDS, NEAR = 12, 0.1  # of finding how late it is, and sigmas by which that may yet move
MOST = 0.5  # of the time that is looked at: farther apart, what lies before a jump and after it are two tracks


class Moved(NamedTuple):
    """A scene in the order of the times without a jump; order (n,): the samples of the scene that its own are."""

    scene: Scene
    order: IntArray


def moved(scene: Scene, curve: Curve, late_s: float) -> Moved:
    """A scene whose clock is late by so much where the curve acts."""
    time_s = scene.log.time_s.copy()
    time_s[scene.setting.rows(curve)] -= late_s
    order = np.argsort(time_s, kind="stable")
    there = scene.part(order)
    log = there.log._replace(time_s=time_s[order])
    return Moved(there._replace(log=log, setting=there.setting._replace(time_s=log.time_s)), order)


def gap_s(setting: Setting, sample: int) -> float:
    """How much longer than usual it takes to a sample from the one before, s: as late the clock may be from it on."""
    if not 0 < sample < len(setting.time_s):
        return 0.0
    return float(setting.time_s[sample] - setting.time_s[sample - 1]) - setting.interval_s()


def gaps(setting: Setting, most: int) -> list[Jump]:
    """The largest gaps, in which a clock may have jumped."""
    longer = np.diff(setting.time_s) / setting.interval_s()
    largest = np.argsort(-longer, kind="stable")[:most]
    return [Jump(float(longer[k]), int(k) + 1, 0, ((CLOCK,),)) for k in largest if longer[k] > GAP]


def leaves_gap(setting: Setting, sample: int, late_s: float) -> bool:
    """Whether there is a gap before a sample, or an overlap like one, if the clock is late by so much from it on."""
    return abs(gap_s(setting, sample) - late_s) > (GAP - 1) * setting.interval_s()


def gain_at_a_gap(scene: Scene, sample: int, weight: FloatArray, model: Model) -> float:
    """How much likelier the scene is if the clock jumped in the gap before a sample."""
    late_s = gap_s(scene.setting, sample)
    if late_s <= (GAP - 1) * scene.setting.interval_s():
        return 0.0
    there = moved(scene, Curve(CLOCK, sample, len(weight), (0.0,)), late_s).scene
    return as_it_is(there, weight, model).log_probability - as_it_is(scene, weight, model).log_probability


def weighed_jump(scene: Scene, weight: FloatArray, curve: Curve) -> Weighed:
    """The scene with a jump of its clock, decided on from these weights on. Raises ValueError where a component has too
    few readings."""
    scale_s = WIDE_CLOCK * scene.setting.interval_s()
    most_s = MOST * float(np.ptp(scene.log.time_s))
    first = (each for each in _first(scene, weight, curve) if abs(each) <= most_s)
    found = [_likeliest(scene, weight, curve, first_s, most_s) for first_s in first]
    late_s, information, _ = max(found, key=lambda each: each[2])
    there = moved(scene, curve, late_s)
    best = weighed(there.scene, weight[there.order], ())
    decided = np.empty_like(weight)
    decided[there.order] = best.weight
    prior = -math.log(math.pi * scale_s) - math.log1p((late_s / scale_s) ** 2)
    likely = best.log_probability + prior + 0.5 * math.log(2 * math.pi / information)
    return Weighed((curve._replace(size=(late_s,)),), (information**-0.5,), decided, best.model, likely)


def _likeliest(
    scene: Scene, weight: FloatArray, curve: Curve, late_s: float, most_s: float
) -> tuple[float, float, float]:
    """How late the clock is, s, from a first value on, at most so much; what the log says of it, 1/s2; and how likely
    it is then."""
    best = (late_s, 1.0, -math.inf)
    for _ in range(ROUNDS):
        (there, order), model = moved(scene, curve, late_s), scene.at_median
        log = there.log._replace(weight=weight[order])
        starts = there.starts(log)
        state = smooth_log(log, model, starts, STATES).state
        rows = np.isin(order, scene.setting.rows(curve))
        late = np.where(rows[:, None], late_of(log, state), 0.0)
        whole = Curve(CLOCK, 0, len(order), (0.0,), curve.station)
        columns = columns_of([whole], there.setting._replace(late=late))
        said = said_of(log, model, starts, columns)
        information = float(said.information[0, 0])
        if not information > 0 or said.log_likelihood <= best[2]:
            break
        best = (late_s, information, said.log_likelihood)
        step_s = float(said.score[0]) / information
        late_s += step_s
        if abs(step_s) < NEAR * information**-0.5 or abs(late_s) > most_s:
            break
    return best


def _first(scene: Scene, weight: FloatArray, curve: Curve) -> Iterator[float]:
    """How late the clock may be: such that the first readings after it fit the track before it, at any earlier time, or
    somewhat later; none, too."""
    yield 0.0
    if (left_s := gap_s(scene.setting, curve.begin)) > 0:
        yield left_s
    before, after = slice(0, curve.begin), slice(curve.begin, curve.begin + COMPARED)
    if scene.log.sites is not None or min(curve.begin, curve.end - curve.begin) < COMPARED:
        return
    log = scene.log.part(before)._replace(weight=scene.taken_in[before])
    try:
        starts = scene.part(before).starts(log)
    except ValueError:
        return
    state = smooth_log(log, scene.at_median, starts, STATES).state
    time_s, z = scene.log.time_s[after], scene.log.measurement[after]
    interval_s = scene.setting.interval_s()
    tried_s = np.arange(-COMPARED * interval_s, time_s[0] - log.time_s[0], interval_s / PLACES)
    away = _away(log.time_s, state, (time_s - tried_s[:, None]).ravel(), np.tile(z, (len(tried_s), 1)))
    off = np.abs(away).reshape(len(tried_s), len(z), 3) / np.sqrt(scene.at_median.noise_variance)
    loss = np.nanmedian(off[:, :, np.isfinite(z).any(0)], 1).sum(1)
    inner = np.flatnonzero((loss[1:-1] <= loss[:-2]) & (loss[1:-1] <= loss[2:])) + 1
    for k in sorted(inner.tolist(), key=lambda k: loss[k])[:TRIED]:
        yield float(tried_s[k])


def _away(time_s: FloatArray, state: FloatArray, wanted: FloatArray, z: FloatArray) -> FloatArray:
    """(m, 3) by which readings differ from those of a track at some times (m,)."""
    off = z - from_cartesian(moved_to(time_s, state, wanted)[:, :3])
    off[:, 1] = wrap(off[:, 1])
    return off
