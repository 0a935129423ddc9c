"""Time codes of video, hours:minutes:seconds:frames (SMPTE 12M), and hundredths written the same way."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ftproc.errors import InputError
from ftproc.files import arrow
from ftproc.files.reading.clocks.clock import DAY_S, Clock, unrolled
from ftproc.files.reading.meaning.numbers import Origin
from ftproc.order_statistics import median
from ftproc.records import FloatArray

if TYPE_CHECKING:
    import pyarrow as pa

    from ftproc.files.reading.meaning.schema import Column

_CELL = r"^(?P<hour>\d{2}):(?P<minute>\d{2}):(?P<second>\d{2})(?P<mark>[:;])(?P<frame>\d{2})$"
_RATES = (24, 25, 30, 48, 50, 60)  # frames in a second
_NAMES = frozenset(("timecode", "smpte", "ltc", "vitc", "tc"))
_PER_SECOND = re.compile(r"(\d+(?:\.\d+)?)fps")
_HUNDREDTHS, _FRAMES = ("hhmmsscc", "hhmmsshh"), ("hhmmssff",)
_EVENLY = 0.95  # of the steps of frames are the usual one
_DROPPED, _NTSC = 2, 1000.0 / 1001.0  # frame numbers left out each minute but every tenth; of 30 frames in a second


class _Cells(NamedTuple):
    """(n,) seconds since midnight and frames, and whether frame numbers are dropped."""

    second: FloatArray
    frame: FloatArray
    drops: bool


def read(text: pa.ChunkedArray, origin: Origin, column: Column) -> Clock | None:
    """The clock of a column of time codes; None of others. Raises InputError where the cells leave the rate open."""
    cells = _cells(text)
    if cells is None:
        return None
    if column.notation in _HUNDREDTHS:
        return _clock(cells.second + cells.frame / 100, "hours, minutes, seconds and hundredths")
    stated = _PER_SECOND.fullmatch(column.notation)
    named = stated or cells.drops or column.key in _NAMES or column.notation in _FRAMES
    most = float(np.nanmax(cells.frame))
    full = bool((np.diff(cells.second) > 0).any())  # a second has passed, so its last frame has been seen
    rate = float(stated[1]) if stated else next((float(each) for each in _RATES if full and most == each - 1), None)
    if cells.drops:
        rate = rate or 30.0
    if rate is None and named:
        raise InputError(
            f'{origin.source}: "{column.name}" holds time codes, whose frames go up to {most:.0f}; nothing says how '
            'many there are in a second. Rename it so that it does, such as to "Timecode (25 fps)".'
        )
    # Sixty of something may be seconds, behind day, hour and minute.
    if not named and not (rate and rate < 60 and _is_evenly(cells.second + cells.frame / rate)):
        if most < 60:
            return None  # day of year and time of day
        return _clock(cells.second + cells.frame / 100, "hours, minutes, seconds and hundredths")
    assert rate is not None
    if not cells.drops:
        return _clock(cells.second + cells.frame / rate, f"time codes of {rate:g} frames in a second")
    minutes = np.floor(cells.second / 60)
    count = cells.second * 30 + cells.frame - _DROPPED * (minutes - np.floor(minutes / 10))
    return _clock(count / (30 * _NTSC), "time codes of 29.97 frames in a second, with dropped numbers")


def _cells(text: pa.ChunkedArray) -> _Cells | None:
    import pyarrow as pa
    import pyarrow.compute as pc

    fields = pc.extract_regex(text, pattern=_CELL)
    if fields.null_count > text.null_count:
        return None
    hour, minute, second, frame = (
        arrow.to_numpy(pc.struct_field(fields, name).cast(pa.float64()))
        for name in ("hour", "minute", "second", "frame")
    )
    if not ((hour < 24) & (minute < 60) & (second < 60) | np.isnan(hour)).all():
        return None
    drops = ";" in pc.unique(pc.struct_field(fields, "mark")).to_pylist()
    left_out = (second == 0) & (minute % 10 != 0) & (frame < _DROPPED)
    return _Cells(3600 * hour + 60 * minute + second, frame, drops and not left_out.any())


def _is_evenly(time_s: FloatArray) -> bool:
    steps = np.diff(time_s[np.isfinite(time_s)])
    usual = median(steps) if steps.size else 0.0
    return bool(0 < usual < 1 and np.mean(np.abs(steps - usual) < 1e-6) > _EVENLY)


def _clock(time_s: FloatArray, words: str) -> Clock:
    whole, notes = unrolled(time_s, DAY_S)
    return Clock(whole, "", f"{words}, in s since midnight", notes)
