"""Steps that stand out of a calm flight, by what a record says of a step between any two samples."""

from __future__ import annotations

import contextlib
import math

import numpy as np

from ftproc.core.filtering.bridging import CLOCK, Step
from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.records import Model, Observations
from ftproc.core.filtering.shifts import Shifts, shifts
from ftproc.core.identification import decimation
from ftproc.core.identification.scales import scales_of

LEAST = 6.0  # sigmas of a step's estimate that make it worth weighing,
MERGED = 0.7  # times that where neighbours are merged, one of which may be of both sides
MOST = 8  # steps that are weighed at a time
SMALLEST = 4.5  # sigmas of the noise that a step is large,
SMALL = 0.7  # times that, before its size is found with the outliers beside it
END, SHARE = 48, 0.1  # samples at either end, or share of a short log, in which a step cannot be told from a patch


def standing_out(log: Observations, calm: Model, apart: int) -> list[Step]:
    """The steps that stand out of a calm flight, the clearest first, and so many samples apart. Where readings are
    dense, they show where neighbours are merged, and then where each is looked at."""
    starts, end = find_starts(log, calm.noise_variance, float(calm.jerk[0, 0])), end_of(len(log.time_s))
    count = decimation.how_many(scales_of(log, calm.noise_variance), calm, math.inf)
    merged, begins = decimation.merged(log, starts, count)
    if merged is log:
        return _largest(shifts(log, calm, starts), calm, 1.0, apart, end)
    found: dict[tuple[int, int], Step] = {}
    for coarse in _largest(shifts(merged, calm, begins), calm, MERGED, max(apart // count, 1), end // count):
        place = int(np.searchsorted(log.time_s, merged.time_s[coarse.sample]))
        first = max(place - 2 * apart, 0)
        near = log.part(slice(first, place + 2 * apart))
        with contextlib.suppress(ValueError):  # a component has too few readings there
            each = shifts(near, calm, find_starts(near, calm.noise_variance, float(calm.jerk[0, 0])))
            for step in _largest(each, calm, 1.0, apart, 0):
                if step.component == coarse.component and abs(first + step.sample - place) <= apart:
                    found.setdefault((step.component, first + step.sample), step._replace(sample=first + step.sample))
                    break
    return [*found.values()]


def _largest(found: Shifts, calm: Model, times: float, apart: int, end: int) -> list[Step]:
    """The steps that stand out, the clearest first, so many samples apart and from the ends. times: what they must
    exceed so many times to do so."""
    score, information = found.score.copy(), found.information
    small = times * SMALL * SMALLEST * np.sqrt(calm.noise_variance) * information[:, :3]
    score[:, :3] = np.where(np.abs(score[:, :3]) > small, score[:, :3], 0.0)
    size = np.divide(
        np.abs(score), np.sqrt(np.maximum(information, 0)), out=np.zeros_like(score), where=information > 0
    )
    size[:end], size[len(size) - end :] = 0.0, 0.0
    steps: list[Step] = []
    while len(steps) < MOST and size.max() > times * LEAST:
        k, c = (int(i) for i in np.unravel_index(int(size.argmax()), size.shape))
        estimate, sigma = score[k, c] / information[k, c], 1 / math.sqrt(information[k, c])
        steps.append(Step(c, k + 1, float(-estimate if c == CLOCK else estimate), sigma))
        near = slice(max(k - apart, 0), k + apart)
        size[near, c] = 0.0
        size[near, CLOCK] = 0.0  # which is no jump where one component stands out more
    return steps


def end_of(samples: int) -> int:
    """Samples at either end of so many in which a step cannot be told from a patch."""
    return 1 + min(END, int(SHARE * samples))
