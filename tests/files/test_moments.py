"""Times for people."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from ftproc.files.moments import Moments
from ftproc.files.reading import logs
from ftproc.quality.statistics import RunStatistics

KNOWN = Moments("2024-05-25T00:00:00Z", 43_430.25, 43_505.25)
SECONDS_OF_THE_DAY = Moments("", 50_641.9, 50_716.9)
TIMES = np.array([43_430.25, 43_505.25])
FROM_ZERO = Moments("", 0.0, 60.0)


def test_with_a_clock():
    assert KNOWN.begins == "2024-05-25 12:03:50.25 UTC"
    assert KNOWN.clock(43_491.25) == "12:04:51.25"
    assert KNOWN.clock(43_491.999, 0) == "12:04:52"  # rounded, not cut
    assert KNOWN.since(43_491.25) == "T+61.00"
    assert KNOWN.words(43_491.25) == "43491.2 s (12:04:51.25 UTC)"
    assert KNOWN.zero_ms == np.datetime64("2024-05-25", "ms").astype(int)


def test_a_log_of_several_days_says_the_day():
    assert Moments("2024-05-25T00:00:00Z", 0.0, 200_000.0).clock(90_000.0, 0) == "2024-05-26 01:00:00"


def test_without_a_date():
    assert SECONDS_OF_THE_DAY.begins == ""
    assert SECONDS_OF_THE_DAY.zero_ms is None
    assert SECONDS_OF_THE_DAY.clock(50_702.9) == "50,702.90"
    assert SECONDS_OF_THE_DAY.words(50_702.9) == "50702.9 s (T+61.00 s)"
    assert FROM_ZERO.words(12.3) == "12.3 s"
    assert not FROM_ZERO.counts_from_elsewhere


def test_a_clock_whose_zone_nobody_states_is_not_called_utc():
    summary = {"epoch": "2024-05-25T00:00:00Z", "start_s": 43_430.25, "duration_s": 75.0, "zone_stated": False}
    for unsaid in (Moments.of_summary(summary), Moments.of({"epoch": summary["epoch"], "summary": summary}, TIMES)):
        assert unsaid.begins == "2024-05-25 12:03:50.25"
        assert unsaid.words(43_491.25) == "43491.2 s (12:04:51.25)"
    table = {"time": [f"2024-05-25 12:00:0{k}" for k in range(9)], "range_m": range(9000, 9009)}
    for zone, stated in (("", False), ("Z", True)):
        log = logs.read(pd.DataFrame({**table, "time": [each + zone for each in table["time"]]}))
        assert RunStatistics(log, (1, 2)).zone_stated is stated


def test_a_leap_second_is_counted():
    """2016 ended with 23:59:60, so 86,401 s after its last midnight it is midnight again."""
    moments = Moments("2016-12-31T00:00:00Z", 86_300.0, 86_500.0)
    assert moments.clock(86_401.0, 0) == "00:00:00"


@pytest.mark.parametrize("epoch", ["soon", "2024-13-99T00:00:00Z", None, 7])
def test_an_epoch_of_another_program_is_none(epoch):
    moments = Moments.of({"epoch": epoch}, np.array([1.0, 2.0]))
    assert moments.utc(1.0) is None
    assert moments.clock(1.0) == "1.00"


def test_of_no_rows():
    assert Moments.of({}, np.empty(0)).start_s == 0
