"""The logs of a range read, and brought to one clock, one frame and one sense of the azimuth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime

import numpy as np

from ftproc.core.components import bounded
from ftproc.core.editing.copies import without_copies
from ftproc.core.model.earth import Geodetic
from ftproc.core.model.frames import wrap
from ftproc.errors import InputError
from ftproc.files.decisions import Decisions
from ftproc.files.reading import logs
from ftproc.fusion import positions
from ftproc.fusion.estimation import beside
from ftproc.fusion.estimation.events import Seen
from ftproc.fusion.range_file import POSITION, Instrument, Range
from ftproc.methods.height.priors import prior_of
from ftproc.quality import sanity
from ftproc.records import ACCEPTED, REJECTED, FloatArray, MeasurementLog

HOUR_S = 3600.0
ZONES = range(-14, 15)  # hours by which a clock of another time zone is off


def read(range_: Range, decisions: Decisions | None = None) -> tuple[Range, list[MeasurementLog]]:
    """The log of each station, with the decisions by hand on it; and the range with the places from which positions are
    seen. Raises InputError, UsageError."""
    both = [
        positions.read(each, range_.origin) if each.kind == POSITION
        else (each, logs.read(each.log, **each.recipe.reading()))
        for each in range_.instruments
    ]  # fmt: skip
    range_, found = replace(range_, instruments=tuple(each for each, _ in both)), [log for _, log in both]
    instruments = range_.instruments
    if decisions is not None:
        decisions.check([each.name for each in instruments], same_clock=True)
        found = [decisions.applied(log, each.name) for log, each in zip(found, instruments, strict=True)]
    for log in found:
        sanity.check(log)
    return range_, found


def as_seen(
    instruments: Sequence[Instrument], found: Sequence[MeasurementLog], origin: Geodetic | None = None
) -> tuple[list[Seen], float]:
    """What the stations have seen, with the time of the first reading taken as zero, and that time. Raises InputError
    if their dates contradict each other."""
    shifts = _shifts(instruments, found)
    zero = min(float(log.time_s[0]) + shift for log, shift in zip(found, shifts, strict=True))
    seen = []
    for instrument, log, shift in zip(instruments, found, shifts, strict=True):
        z, accepted = bounded(log.measurement), np.zeros(log.measurement.shape, bool)
        if log.by_hand is not None:
            flags = log.by_hand.flags
            z[flags == REJECTED], accepted = np.nan, flags == ACCEPTED
        if log.frame == "north-east-up":
            z[:, 1] = math.pi / 2 - z[:, 1]
        z[:, 1] = wrap(z[:, 1])
        of_range, azimuth, elevation = (bool(np.isfinite(z[:, c]).any()) for c in range(3))
        tilts = azimuth or elevation
        sides, of_heights = beside.sides(log, instrument.place, origin)
        prior = np.where([of_range, azimuth, elevation, tilts, tilts, True], instrument.prior, 0.0)
        if instrument.height_sigma_m is not None:
            of_heights = np.array([instrument.height_sigma_m, of_heights[1] * (instrument.height_sigma_m > 0)])
        prior = np.concatenate([prior, of_heights])
        stated = instrument.options.get("noise") or (None, None, None)
        time_s = np.array(log.time_s) + shift - zero
        z, kind = without_copies(time_s, z, accepted)
        copied = np.stack([np.bincount(each, minlength=4) for each in kind.T])
        seen.append(
            Seen(
                instrument.name, time_s, z, instrument.place, instrument.axes, prior, np.array(stated, float), accepted,
                sides, instrument.times, instrument.away_m, copied, elevated=beside.elevated(log),
            )
        )  # fmt: skip
    priors = [prior_of(log, each.recipe.settings) for each, log in zip(instruments, found, strict=True)]
    return beside.with_prior(seen, priors, origin), zero


def epoch(found: Sequence[MeasurementLog]) -> str:
    """The instant of time zero (ISO 8601, UTC): the first of the logs' dates; "" if none has one."""
    dates = [log.epoch for log, date in zip(found, _dates(found), strict=True) if date is not None]
    return min(dates, key=lambda text: datetime.fromisoformat(text.replace("Z", "+00:00")), default="")


def _dates(found: Sequence[MeasurementLog]) -> list[datetime | None]:
    return [None if not log.epoch else datetime.fromisoformat(log.epoch.replace("Z", "+00:00")) for log in found]


def _shifts(instruments: Sequence[Instrument], found: Sequence[MeasurementLog]) -> FloatArray:
    """(m,) s that bring logs of different dates to the first of these dates."""
    dates = _dates(found)
    known = [date for date in dates if date is not None]
    if not known:
        return np.zeros(len(found))
    return np.array([0.0 if date is None else (date - min(known)).total_seconds() for date in dates])


def check_overlap(range_: Range, seen: Sequence[Seen]) -> None:
    """Raise InputError for a station whose times have nothing in common with those of the others, if it cannot have
    handed the target over to them: two that see its place, with a pause shorter than either log."""
    for k, station in enumerate(seen):
        others = [other for j, other in enumerate(seen) if j != k]
        if not others or any(_overlap(station, other, 0.0) > 0 or _hands_over(station, other) for other in others):
            continue
        first, last = station.time_s[0], station.time_s[-1]
        spans = ", ".join(f"{other.name} {other.time_s[0]:.6g} to {other.time_s[-1]:.6g} s" for other in others)
        hour = next(
            (h for h in sorted(ZONES, key=abs) if any(_overlap(station, o, h * HOUR_S) > 0 for o in others)), None
        )
        cure = "name the log of the same flight, or leave the station out"
        if hour is not None:
            cure = (
                f"it would with {hour * HOUR_S:+g} s added to its times (a time zone?): write "
                f"time_offset_s = {hour * HOUR_S:g} in [station.{station.name}]"
            )
        raise InputError(
            f"{range_.path}: {station.name} ({first:.6g} to {last:.6g} s after the first reading) overlaps with no "
            f"other station ({spans}); {cure}."
        )


def _hands_over(one: Seen, other: Seen) -> bool:
    spans = [float(each.time_s[-1] - each.time_s[0]) for each in (one, other)]
    return one.sees_place and other.sees_place and bool(-_overlap(one, other, 0.0) < min(spans))


def _overlap(one: Seen, other: Seen, added: float) -> float:
    return float(min(one.time_s[-1] + added, other.time_s[-1]) - max(one.time_s[0] + added, other.time_s[0]))
