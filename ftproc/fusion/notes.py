"""What a reader of a fused flight should know that is no reason to doubt it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ftproc.fusion.estimation import constants as posterior
from ftproc.fusion.estimation.beside import ASSUMED
from ftproc.fusion.estimation.events import CLOCK
from ftproc.fusion.estimation.whole import Fused
from ftproc.quality import faults
from ftproc.quality.verdict import CONSISTENT, Remark


def notes(fused: Fused, zero_s: float) -> Iterator[Remark]:
    """All of them. zero_s: the logs' time of the first reading."""
    for text in (*_clocks(fused), *_handed_over(fused, zero_s), *_beside(fused), *_unobserved(fused)):
        yield Remark(CONSISTENT, text)


def _clocks(fused: Fused) -> Iterator[str]:
    prior = fused.constants.prior[:, CLOCK]
    if len(prior) > 1 and not prior.any():
        yield "all clocks are taken as exact (clock_offset_sigma_s = 0 everywhere): none is estimated"
    elif (prior > 0).all():
        text = "no clock is the reference (clock_offset_sigma_s = 0): the time of all is known as well as"
        yield f"{text} the best of them"


def _handed_over(fused: Fused, zero_s: float) -> Iterator[str]:
    """Stations that saw the target before or after all others."""
    for s, station in enumerate(fused.stations):
        first, last = station.time_s[0], station.time_s[-1]
        others = [other for k, other in enumerate(fused.stations) if k != s]
        if others and all(other.time_s[0] > last or other.time_s[-1] < first for other in others):
            when = f"{first + zero_s:.6g} to {last + zero_s:.6g} s"
            yield f"{station.name} saw the target at other times than all others ({when}): none checks its readings"


def _beside(fused: Fused) -> Iterator[str]:
    """What was done with copies, and with what stands beside the readings."""
    for station in fused.stations:
        for c in station.components:
            measured = int(np.isfinite(station.measurement[:, c]).sum())
            for text in faults.copies_in_words(station.names[c], faults.copies(station.copied[c]), measured):
                yield f"{station.name}: {text}"
        yield from (side.why for side in station.beside if side.name == ASSUMED)
        if station.elevated:
            yield f"{station.name}: the heights beside the elevations are not used, as those of a single log are"
    for station, sides in zip(fused.stations, fused.beside, strict=False):
        for each in sides.values():
            if each.side.why:
                yield f"{station.name}: {each.side.why}"
            elif each.side.closing:
                yield f"{station.name}: the range rates count inward, as the motion shows, and are turned round"


def _unobserved(fused: Fused) -> Iterator[str]:
    unobserved = posterior.not_observable(fused.constants, [station.name for station in fused.stations])
    if unobserved:
        yield f"cannot be told: {'; '.join(unobserved)} (1-sigma stays at the prior's)"
