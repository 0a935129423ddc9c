"""Clocks with coarse steps: rows are spread where they are regular and the target moves on."""

from collections.abc import Callable
from unittest import mock

import numpy as np
import pytest

from ftproc.files.reading import logs
from ftproc.files.reading.formats import blocks, content
from ftproc.files.reading.meaning.values import stamps
from ftproc.records import FloatArray, MeasurementLog
from tests.files.conftest import Make

Write = Callable[[float], str]


def flown(make: Make, time_s: FloatArray, write: Write, head: str = "time_s", still: float = 1.0) -> MeasurementLog:
    """A log of a flight at 150 m/s with the times as they are written; read in blocks it is the same."""
    rng = np.random.default_rng(1)
    noise = rng.normal(0, 1, (3, len(time_s))) * [[3], [2e-4], [2e-4]]
    moved = time_s * still
    readings = np.array([4000 + 150 * moved, 0.3 + 0.01 * moved, 0.2 + 0.002 * moved]) + noise
    rows = "".join(
        f"{write(t)},{r!r},{a!r},{e!r}\n" for t, (r, a, e) in zip(time_s.tolist(), readings.T.tolist(), strict=True)
    )
    path = make(f"{head},range_m,azimuth_rad,elevation_rad\n{rows}")
    log = logs.read(path)
    with mock.patch.object(content, "LARGE", 0), mock.patch.object(blocks, "_BLOCK", 4096):
        assert np.array_equal(logs.read(path).time_s, log.time_s)
    return log


def cut(step: float, digits: int) -> Write:
    return lambda t: f"{np.floor(t / step + 1e-9) * step:.{digits}f}"


@pytest.mark.parametrize(
    ("rate", "write", "words"),
    [
        (10, cut(1, 0), "the times are whole seconds with 10 rows in each, which are spread evenly"),
        (100, cut(1, 0), "the times are whole seconds with 100 rows in each"),
        (12.5, cut(1, 0), "the times are whole seconds with 12.5 rows in each"),
        (10, "{:.0f}".format, "the times are rounded to whole seconds with 10 rows in each"),
        (20, "{:.1f}".format, "the times are rounded to multiples of 0.1 s with 2 rows in each"),
        (25, "{:.1f}".format, "the times are rounded to multiples of 0.1 s with 2.5 rows in each"),
        (25, cut(0.1, 1), "the times are multiples of 0.1 s with 2.5 rows in each"),
        (8, "{:.1f}".format, "the times are rounded to multiples of 0.1 s though rows come every 0.125 s"),
    ],
)
def test_the_rows_of_a_coarse_clock_are_spread(make: Make, rate: float, write: Write, words: str) -> None:
    time = np.arange(30 * int(rate)) / rate
    log = flown(make, time, write)
    np.testing.assert_allclose(log.time_s, time, atol=0.3 / rate)
    assert words in " ".join(log.remarks)


@pytest.mark.parametrize(("head", "day", "digits"), [("JD", 2460462.5, 5), ("Date", 45443.5, 6)])
def test_dates_with_few_decimals_are_spread(make: Make, head: str, day: float, digits: int) -> None:
    time = np.arange(300) / 10
    log = flown(make, time, lambda t: f"{day + t / 86400:.{digits}f}", head)
    np.testing.assert_allclose(log.time_s - log.time_s[0], time, atol=0.01)


def test_lost_rows_and_a_pause_stay_where_they_are(make: Make) -> None:
    time = np.arange(900) / 10
    time = time[~np.isin(np.arange(900), [100, 333, 700, *range(400, 450)])]
    log = flown(make, time, cut(1, 0))
    assert np.median(np.abs(log.time_s - time)) < 0.01
    assert np.abs(log.time_s - time).max() < 0.3


@pytest.mark.parametrize(
    ("time", "write", "still"),
    [
        (np.arange(300) // 10 * 1.0, "{:.0f}".format, 1.0),  # ten readings of one moment
        (np.arange(300) / 10, cut(1, 0), 0.0),  # nothing moves, so nothing shows
        (np.arange(300) / 10, "{:.1f}".format, 1.0),
        (np.delete(np.arange(600) / 10, np.s_[4::5]), "{:.1f}".format, 1.0),  # each fifth row is lost
        (np.sort(np.random.default_rng(2).uniform(0, 60, 300)), "{:.1f}".format, 1.0),
    ],
)
def test_times_that_are_right_stay(make: Make, time: FloatArray, write: Write, still: float) -> None:
    log = flown(make, time, write, still=still)
    assert log.time_s.tolist() == [float(write(t)) for t in time.tolist()]


def test_a_regular_clock_costs_nothing() -> None:
    with mock.patch.object(stamps, "_periods") as never:
        for time in (np.arange(5000) / 20, np.delete(np.arange(5000) / 20, [7, 70, 700])):
            assert stamps.coarse(time) is None
    never.assert_not_called()
