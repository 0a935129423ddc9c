"""Which understanding of the newest part holds: as it is decided on, with its last readings taken in again, or with
readings that have jumped beside the track."""

from __future__ import annotations

import math

from ftproc.core import odds, pacing
from ftproc.core.filtering.records import Model
from ftproc.core.identification.scales import Scales
from ftproc.core.live.newest import levels
from ftproc.core.live.newest.readmission import Open, readmitted, settled

COMPONENTS = 3  # that may jump at once
PER_S, MOST_S = 320_000, 0.3  # samples that may be swept through to weigh what else may hold, for each second that the
# readings last, and so long it is kept (of 12 dense flights two are worse with half of it, one is with this)
AT_ONCE = 0.5  # of what the time since the last decisions allows, after which nothing more of it starts (longest burst
# at 100 Hz 87 to 56 sweeps, two of 24 dense runs at 20 Hz are worse)


class Deciding:
    """The decisions of a window, and what they may still cost: where that is used up they are settled, and what else
    may hold is weighed later. left: samples that may be swept through. fresh: those that are new since that was
    weighed. until_s: time of the newest one. may_start: as much of this thread's work, until which something may
    start."""

    def __init__(self) -> None:
        self.left, self.fresh, self.until_s, self.may_start = PER_S * MOST_S, 0, math.inf, 0.0

    def decided(
        self, case: Open, gate: float, profile: Model, scales: Scales | None, jumps: bool, fresh: int
    ) -> tuple[Open, Model]:
        """The likeliest case, and the process noise without its allowance. gate: in sigmas. scales: see `readmitted`.
        jumps: whether readings may jump, as the track is old enough to tell. fresh: samples that are new."""
        now_s = float(case.log.time_s[-1])
        since_s = MOST_S if self.until_s == math.inf else max(min(now_s - self.until_s, MOST_S), 0.0)
        self.left, self.until_s, self.fresh = self.left + PER_S * since_s, now_s, self.fresh + fresh
        self.left = min(self.left, PER_S * MOST_S)
        case, before = settled(case, gate), pacing.spent()
        self.may_start = before + min(self.left, AT_ONCE * PER_S * since_s)
        found = self._likeliest(case, gate, profile, scales, jumps)
        self.left -= pacing.spent() - before
        return found

    def _likeliest(
        self, case: Open, gate: float, profile: Model, scales: Scales | None, jumps: bool
    ) -> tuple[Open, Model]:
        """See `decided`."""
        if scales is not None and pacing.spent() < self.may_start:
            later = levels.hindsight(case, profile, scales, self.fresh)
            self.fresh = 0
            if later is not None and later.gain > odds.LIKELIER:
                return settled(later.case, gate), later.profile
        for _ in range(COMPONENTS):
            if pacing.spent() >= self.may_start:
                break
            other = readmitted(case, profile, scales)
            rival = 0.0 if other is None else max(other.gain, 0.0)
            level = levels.likeliest(case) if jumps else None
            if level is not None and level[1] > rival + odds.LIKELIER:
                case = settled(level[0], gate)
                continue
            if other is not None and rival > odds.LIKELIER:
                return settled(other.case, gate), other.profile
            break
        return case, profile
