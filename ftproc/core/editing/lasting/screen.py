"""Whether a jump may be a step at all, before steps are weighed: by the log around it as it is understood without one.

A step makes that likelier, as it is or with the rejected readings beside it taken in, whose rejection then need not be
explained. Both are linear problems of a sweep or two, where weighing settles process noise and decisions anew.
"""

from __future__ import annotations

from collections.abc import Sequence

from ftproc.core.editing.lasting import scan
from ftproc.core.editing.lasting.clock import gain_at_a_gap
from ftproc.core.editing.lasting.curves import CLOCK, Curve
from ftproc.core.editing.lasting.proposals import edges_about
from ftproc.core.editing.lasting.scan import Jump
from ftproc.core.editing.lasting.weighing import Scene, Weighed, as_it_is
from ftproc.core.filtering.records import Model
from ftproc.core.identification.profile import median_level
from ftproc.core.identification.stretches import runs_of
from ftproc.records import FloatArray, IntArray

LEFT = 6.0  # in log-likelihood. With the process noise of the part: up to 5.4 where there is no step, from 7 on where
# there is; with the median of the log, from 13 on


def leaves_a_jump(part: Scene, jump: Jump, around: tuple[int, int], without: Weighed) -> bool:
    """Whether one of the ways of a jump makes a part of a log likelier than it is without a fault. around: the sample
    of the part about which the jump is, and how far from it at most.

    The process noise with which readings beside the jump were rejected may be more than they need where they are good:
    the typical one of the part may do.
    """
    weight, edges = without.weight, edges_about(len(part.possible), *around)
    if (CLOCK,) in jump.ways and gain_at_a_gap(part, around[0], weight, without.model) > LEFT:
        return True
    for way in jump.ways:
        if _gain(part, jump, way, edges, weight, without.model) > LEFT:
            return True
        taken_in = _with_rejected(part, way, jump.station, around, weight)
        models = (without.model, median_level(without.model)) if (taken_in != weight).any() else ()
        for model in models[: len(without.model.jerk)]:  # of a single level both are the same
            likely = _gain(part, jump, way, edges, taken_in, model) + as_it_is(part, taken_in, model).log_probability
            if likely - without.log_probability > LEFT:
                return True
    return False


def _gain(part: Scene, jump: Jump, way: Sequence[int], edges: IntArray, weight: FloatArray, model: Model) -> float:
    """How much likelier the part becomes with a step of some channels at one of the edges, as if each were off
    alone."""
    log = part.log._replace(weight=weight)
    starts = part.starts(log)
    channels = ((channel, jump.station) for channel in way)
    return sum(float(scan.steps_of(log, model, starts, part.setting, c, edges)[1:].max()) for c in channels)


def _with_rejected(
    part: Scene, way: Sequence[int], station: int, around: tuple[int, int], weight: FloatArray
) -> FloatArray:
    """The weights (n, 3) with the rejected runs beside a jump that may be a track taken in, of the components that
    jump."""
    found, (at, width) = weight.copy(), around
    for c in range(CLOCK) if CLOCK in way else way:
        rows = part.setting.rows(Curve(c, 0, len(weight), (), station))
        rows = rows[part.possible[rows, c]]
        for begin, end in runs_of(weight[rows, c] <= 0):
            run = rows[begin:end]
            if run[0] - width <= at <= run[-1] + width:
                found[run, c] = part.taken_in[run, c]
    return found
