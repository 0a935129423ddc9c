"""Times for people: clock time where the log's clock is known, and seconds since its first row."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ftproc.files import leap_seconds
from ftproc.records import FloatArray

DAY_S = 86_400.0
NO_ZONE = "the timestamps name no time zone and are taken for UTC"  # a doubt about a log's clock
NEAR_ZERO_S = 1.0  # a log that begins so near to its time zero counts from its first row


class Moments(NamedTuple):
    """epoch: the instant of time zero (ISO 8601, UTC), or "". start_s, end_s: the first and the last time of the log.
    zone: behind a clock time; "" where the log states no time zone, and nobody knows whether it is UTC."""

    epoch: str
    start_s: float
    end_s: float
    zone: str = " UTC"

    @classmethod
    def of(cls, metadata: Mapping[str, Any], time_s: FloatArray) -> Moments:
        """Those of a trajectory with these metadata and times (n,), in their order."""
        epoch = metadata.get("epoch")
        known = time_s if len(time_s) else np.zeros(1)
        zone = _zone(metadata.get("summary"))
        return cls(epoch if isinstance(epoch, str) else "", float(known[0]), float(known[-1]), zone)

    @classmethod
    def of_summary(cls, s: Mapping[str, Any]) -> Moments:
        """Those of the log of a summary; of one of an older version, which says nothing of it, as if from zero."""
        start_s = float(s.get("start_s") or 0.0)
        return cls(str(s.get("epoch") or ""), start_s, start_s + float(s.get("duration_s") or 0.0), _zone(s))

    def utc(self, time_s: float) -> np.datetime64 | None:
        """The clock time in UTC, to the microsecond; None where the clock is not known."""
        if not self.epoch:
            return None
        try:
            found: np.datetime64 = leap_seconds.utc(self.epoch, np.array([time_s]), self.start_s)[0]
        except (ValueError, OverflowError):  # metadata of another program
            return None
        return None if np.isnat(found) else found

    @property
    def zero_ms(self) -> float | None:
        """Milliseconds since 1970 (UTC) at time zero, as the clock stands at the start; None where it is not known."""
        start = self.utc(self.start_s)
        return None if start is None else float(start.astype("int64")) / 1e3 - 1e3 * self.start_s

    @property
    def begins(self) -> str:
        """Date and clock time of the first row, such as 2024-05-25 12:00:00.10 UTC; "" where they are not known."""
        start = self.utc(self.start_s)
        return "" if start is None else f"{_rounded(start, 2).replace('T', ' ')}{self.zone}"

    @property
    def counts_from_elsewhere(self) -> bool:
        """Whether seconds since the first row say more than the time itself."""
        return bool(self.epoch) or abs(self.start_s) >= NEAR_ZERO_S

    def clock(self, time_s: float, decimals: int = 2) -> str:
        """Clock time, such as 12:00:00.10, with the date where the log is longer than a day; else the time in s."""
        moment = self.utc(time_s)
        if moment is None:
            return f"{time_s:,.{decimals}f}"
        day, clock = _rounded(moment, decimals).split("T")
        return f"{day} {clock}" if self.end_s - self.start_s > DAY_S else clock

    def since(self, time_s: float, decimals: int = 2) -> str:
        """Seconds since the first row, such as T+12.30."""
        return f"T{time_s - self.start_s:+,.{decimals}f}"

    def words(self, time_s: float) -> str:
        """For a sentence: `60.1 s`; with a clock `43491.2 s (12:04:51.25 UTC)`; if the log does not count from zero,
        `50702.9 s (T+61.00 s)`."""
        plain = f"{time_s:.6g} s" if abs(time_s) < 1e5 else f"{time_s:.2f} s"
        if self.utc(time_s) is not None:
            return f"{plain} ({self.clock(time_s)}{self.zone})"
        return f"{plain} ({self.since(time_s)} s)" if self.counts_from_elsewhere else plain


def _zone(s: object) -> str:
    """Of the log of a summary."""
    return "" if isinstance(s, Mapping) and s.get("zone_stated") is False else Moments._field_defaults["zone"]


def _rounded(moment: np.datetime64, decimals: int) -> str:
    """ISO 8601 with so many decimals of the seconds, rounded."""
    step = 10 ** (6 - decimals)
    micro = int(moment.astype("datetime64[us]").astype("int64"))
    whole = np.datetime64(round(micro / step) * step, "us")
    text = str(whole)
    return text[: len(text) - 6 + decimals] if decimals else text[:-7]
