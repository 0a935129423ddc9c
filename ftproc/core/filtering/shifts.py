"""What a record says of a step between any two samples: the smoother's backward pass with the auxiliary residuals."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part, record, variant, zeros
from ftproc.core.filtering import backward, smoother
from ftproc.core.filtering.filters import FILTER, OFFSETS, Filter, Filters, Posteriors, Updates
from ftproc.core.filtering.forward import LEFT, Residuals, Span
from ftproc.core.filtering.memory import memory_of, scratch
from ftproc.core.filtering.records import SAMPLE, Model, Observations, Start, between
from ftproc.core.model import motion
from ftproc.core.signatures import Layout

FloatArray = NDArray[np.float64]


class Shift(Protocol):
    """What the readings after a sample say of a step between it and the next: of range, azimuth, elevation and the
    clock, see `shifts`."""

    score: Annotated[FloatArray, 4]
    information: Annotated[FloatArray, 4]


SHIFT = record(Shift)
ShiftRecords = Annotated[Any, Layout(SHIFT)]


class ShiftMemory(NamedTuple):
    """`smoother.Memory` where steps take the place of estimates, and the way back knows of offsets: forward they are
    zero."""

    filters: Filters
    before: Filters
    block: Updates
    after: Posteriors
    back: backward.ColouredBackwards
    estimates: ShiftRecords
    residuals: Residuals


class Shifts(NamedTuple):
    """What a record says of a step between each sample and the next: score and information (n, 4), of which
    score / information is the estimate and 1 / information its variance; and the leave-one-out residuals (n, 3) of a
    record without steps."""

    score: FloatArray
    information: FloatArray
    residual: FloatArray


@part
def _store(memory: Any, f: Filter, samples: Any, profile: motion.Profile, k: int, low: int, b: int) -> None:
    """Keep the score and the information of a step that begins after sample k, in a block that begins with sample
    `low`: of the offsets, r and N themselves, of the clock, those along the way that the state goes in a second."""
    back, after, row = memory.back[0], memory.after[k - low], memory.estimates[k]
    r, n, state = back.r, back.n, back.state
    for i in range(3, OFFSETS):
        state[i] = after.x[i]
        for j in range(OFFSETS):
            state[i] += after.p[i, j] * r[j]
    for i in range(3):
        row.score[i] = r[OFFSETS + i]
        row.information[i] = n[OFFSETS + i, OFFSETS + i]
    row.score[3] = row.information[3] = 0.0
    for i in range(6):
        row.score[3] += r[i] * state[3 + i]
        for j in range(6):
            row.information[3] += state[3 + i] * n[i, j] * state[3 + j]


_sweep = kernel(variant(smoother.swept_through, __name__, "_sweep", memory=ShiftMemory, _store=_store))


def shifts(log: Observations, model: Model, starts: list[Start]) -> Shifts:
    """What the record says of steps (de Jong and Penzer 1998, section 3).

    In the first three columns the readings of a component are larger from the next sample on, m, rad, rad: a shock of
    an offset of that component, which the smoother carries along at no variance. In the last the target is seconds
    further on its way, as when the clock jumps. Noise that is correlated is taken for white.
    """
    n = len(log.time_s)
    samples, profile = log.samples(model.reading_variance, scratch(SAMPLE, n)), model.profile(log.time_s)
    found = zeros(SHIFT, n)
    residuals = zeros(LEFT, n)
    for start, stop in between(starts, n):
        first = zeros(FILTER)
        first["x"][0], first["p"][0], first["fade_s"] = start.state, start.covariance, motion.FOREVER_S
        memory = ShiftMemory(*memory_of(stop - start.sample, first, found, residuals))
        memory = memory._replace(back=zeros(backward.COLOURED))
        span = Span(start.sample, stop, start.sample)
        _sweep(span, samples, profile, memory, np.zeros((len(model.jerk), 2, 3)), smoother.STATES)
    return Shifts(
        *(np.ascontiguousarray(each) for each in (found["score"], found["information"], residuals["residual"]))
    )
