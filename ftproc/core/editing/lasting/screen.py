"""Whether a jump may be a step at all, before steps are weighed: by the log around it as it is understood without one.

Its process noise is its own there, and may explain what that of the whole log does not. A step beside which readings
were rejected shows once these are taken in: their rejection is then no longer to be explained. Both are linear
problems of one sweep each, where weighing settles process noise and decisions anew.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ftproc.core.editing.lasting import scan
from ftproc.core.editing.lasting.curves import CLOCK, Curve
from ftproc.core.editing.lasting.proposals import edges_about
from ftproc.core.editing.lasting.scan import Jump
from ftproc.core.editing.lasting.weighing import Scene, Weighed, as_it_is
from ftproc.core.identification.stretches import runs_of
from ftproc.records import FloatArray

LEFT = 6.0  # in log-likelihood: up to 4.8 where there is no step, from 7 on where there is


def leaves_a_jump(part: Scene, jump: Jump, at: int, width: int, without: Weighed) -> bool:
    """Whether one of the ways of a jump, before about a sample of a part of a log, makes this likelier than it is
    without a fault. width: samples within which the jump is known."""
    edges = edges_about(len(part.possible), at, width)
    for way in jump.ways:
        for weight, loss in _understood(part, without, _touched(part, way, jump.station, at, width, without.weight)):
            log = part.log._replace(weight=weight)
            starts = part.starts(log)
            gain = sum(
                scan.steps_of(log, without.model, starts, part.setting, (channel, jump.station), edges)[1:].max()
                for channel in way
            )
            if gain - loss > LEFT:
                return True
    return False


def _understood(part: Scene, without: Weighed, taken_in: FloatArray) -> Iterator[tuple[FloatArray, float]]:
    """The weights (n, 3) of a part without a fault, and those with rejected runs taken in, with what log-probability
    that loses."""
    yield without.weight, 0.0
    if (taken_in != without.weight).any():
        yield taken_in, without.log_probability - as_it_is(part, taken_in, without.model)


def _touched(
    part: Scene, way: Sequence[int], station: int, at: int, width: int, weight: FloatArray
) -> FloatArray:
    """The weights (n, 3) with the rejected runs taken in that may be a track and lie beside a sample, of the components
    that jump."""
    found = weight.copy()
    for c in range(CLOCK) if CLOCK in way else way:
        rows = part.setting.rows(Curve(c, 0, len(weight), (), station))
        rows = rows[part.possible[rows, c]]
        for begin, end in runs_of(weight[rows, c] <= 0):
            run = rows[begin:end]
            if run[0] - width <= at <= run[-1] + width:
                found[run, c] = part.taken_in[run, c]
    return found
