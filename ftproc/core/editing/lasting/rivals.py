"""Other understandings of a log that are nearly as likely as the one that was chosen: the readings as they would be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing.lasting.curves import Setting
from ftproc.core.editing.lasting.faults import PATCH, STEP, Rival, Step, levelled, taken_out
from ftproc.core.filtering.records import Model, Observations

MOST = 6  # that the sigmas allow for, the likeliest


def others(
    read: Observations, possible: NDArray[np.bool_], model: Model, setting: Setting, steps: Sequence[Step],
    rivals: Sequence[Rival],
) -> Iterator[Observations]:  # fmt: skip
    """The log by each of some rivals. read: with the readings as they were read and the weights as decided. possible
    (n, 3): readings that may be good. steps: that were taken out."""
    for rival in islice(sorted(rivals, key=lambda each: each.gain), MOST):
        weight, rows = read.weight.copy(), slice(rival.begin, rival.end)
        if rival.chosen == PATCH or rival.other == PATCH:
            weight[rows, rival.component] = possible[rows, rival.component] if rival.chosen == PATCH else 0.0
        left = [each for each in steps if rival.chosen != STEP or not _same(each, rival.step)]
        if rival.other == STEP and rival.step is not None:
            left.append(rival.step)
        log = read._replace(weight=weight)
        yield taken_out(log, model, setting, levelled(log, model.noise_variance, left))


def _same(one: Step, other: Step | None) -> bool:
    return other is not None and (one.component, one.sample) == (other.component, other.sample)
