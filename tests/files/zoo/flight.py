"""The flight that every log of the zoo tells of, and an animal of the zoo."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ftproc.records import FloatArray

ROWS, STEP_S = 120, 0.5
START = np.datetime64("2024-05-31T12:34:56.000", "us")
MIDNIGHT_START = np.datetime64("2024-05-31T23:59:30.000", "us")


class Flight(NamedTuple):
    """t: (n,) s from 0. r: m. a, e: rad, the azimuth within one turn, passing north. moments: datetime64[us]."""

    t: FloatArray
    r: FloatArray
    a: FloatArray
    e: FloatArray

    def moments(self, start: np.datetime64 = START) -> np.ndarray:
        return start + np.round(self.t * 1e6).astype("timedelta64[us]")

    def sod(self, start: np.datetime64 = START) -> FloatArray:
        """Seconds of the day."""
        moments = self.moments(start)
        return (moments - moments.astype("datetime64[D]")).astype(np.int64) / 1e6


@cache
def flight(which: int = 0) -> Flight:
    """An aircraft that passes north of the station, with the noise of a tracker; another one for another number."""
    rng = np.random.default_rng(18 + which)
    t = np.arange(ROWS) * STEP_S
    x = 5200.0 - 1500 * which + 35 * t
    y = -2600.0 + 900 * which + 95 * t
    z = 1400.0 + 700 * which + 4 * t
    r = np.sqrt(x**2 + y**2 + z**2) + rng.normal(0, 2, ROWS)
    a = np.arctan2(y, x) + rng.normal(0, 2e-4, ROWS)
    e = np.arcsin(z / np.sqrt(x**2 + y**2 + z**2)) + rng.normal(0, 2e-4, ROWS)
    return Flight(t, r, a % (2 * np.pi), e)


Write = Callable[[Path], Path]


@dataclass(frozen=True)
class Animal:
    """name: what is special. write: makes the file in a directory. options: of `logs.read`, only what no program can
    know. first_s: time of the first row, NaN to leave it open. utc: of the first row, "" when the log does not say.
    asks: the option that the refusal must name, when the first reading must end in a question. tolerance: of lengths
    in m; a hundred thousandth of it for angles in rad. clock: of times, s. absent: of range, azimuth and elevation.
    """

    name: str
    write: Write
    options: dict[str, Any] = field(default_factory=dict)
    first_s: float = float("nan")
    utc: str = ""
    asks: str = ""
    answer: dict[str, Any] = field(default_factory=dict)
    tolerance: float = 0.02
    clock: float = 2e-4
    absent: tuple[bool, bool, bool] = (False, False, False)
    missing: int = 0
    which: int = 0


def written(name: str, content: str | bytes) -> Write:
    """A file of this content."""

    def write(directory: Path) -> Path:
        path = directory / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write


def lines(head: str, *columns: Any, separator: str = ",", tail: str = "") -> str:
    """Text: the lines above, the rows, the lines below. Columns of numbers get nine digits."""
    cells = [
        [f"{v:.9g}" if isinstance(v, float) else str(v) for v in column.tolist()] for column in map(np.asarray, columns)
    ]
    body = "\n".join(separator.join(row) for row in zip(*cells, strict=True))
    return (f"{head}\n" if head else "") + body + "\n" + tail


def fixed(values: FloatArray, digits: int) -> np.ndarray:
    return np.array([f"{v:.{digits}f}" for v in values])


def dms(angle: FloatArray, pattern: str) -> np.ndarray:
    """(n,) angles in rad as degrees, minutes and seconds; pattern: with d, m and s."""
    seconds = np.round(np.degrees(angle) * 3600, 2)
    d, rest = np.divmod(seconds, 3600)
    m, s = np.divmod(rest, 60)
    return np.array([pattern.format(d=int(i), m=int(j), s=k) for i, j, k in zip(d, m, s, strict=True)])


def clock(moments: np.ndarray, pattern: str = "%H:%M:%S.%f") -> np.ndarray:
    """Moments as text."""
    return np.array([moment.strftime(pattern) for moment in moments.tolist()])
