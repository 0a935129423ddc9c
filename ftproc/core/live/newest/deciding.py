"""Which understanding of the newest part holds: as it is decided on, with its last readings taken in again, or with
readings that have jumped beside the track."""

from __future__ import annotations

from ftproc.core import odds
from ftproc.core.filtering.records import Model
from ftproc.core.identification.scales import Scales
from ftproc.core.live.newest import levels
from ftproc.core.live.newest.readmission import Open, readmitted, settled

COMPONENTS = 3  # that may jump at once


def decided(
    case: Open, gate: float, profile: Model, scales: Scales | None, jumps: bool, fresh: int
) -> tuple[Open, Model]:
    """The likeliest case, and the process noise without its allowance. gate: in sigmas. scales: see `readmitted`.
    jumps: whether readings may jump, as the track is old enough to tell. fresh: samples that are new."""
    case = settled(case, gate)
    later = levels.hindsight(case, profile, scales, fresh) if scales is not None else None
    if later is not None and later.gain > odds.LIKELIER:
        return settled(later.case, gate), later.profile
    for _ in range(COMPONENTS):
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
