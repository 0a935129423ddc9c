"""Faults in words, and a clock that was set back."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.core.editing.copies import HELD
from ftproc.core.editing.lasting.curves import CLOCK
from ftproc.core.editing.lasting.faults import Faults, Step
from ftproc.core.identification.one_sided import OneSided
from ftproc.quality import faults
from ftproc.quality.verdict import CONSISTENT, SUSPECT
from ftproc.records import MeasurementLog
from ftproc.settings import FilterSettings
from tests.simulated import simulate

TIME = 0.1 * np.arange(100)


def words(steps=(), one_sided=()):
    statistics = faults.FaultStatistics()
    statistics.add(TIME, Faults(np.zeros((100, 3), np.uint8), steps, (), one_sided))
    return list(faults.suspicious(statistics.figures() | {"clock_set_back": None}))


def test_steps_are_named_with_component_size_unit_and_time():
    steps = (Step(1, 60, -4.1e-3, 1e-5), Step(0, 70, 150.0, 1.0), Step(CLOCK, 80, 0.8, 0.01))
    (text,) = words(steps)
    named = "azimuth steps by -4.1 mrad at 6 s; range steps by +150 m at 7 s; the clock jumps by +0.8 s at 8 s"
    assert text == f"{named}: the estimate follows the longer side, which may be the wrong one"
    assert "; and 3 more: " in words(tuple(Step(0, k, 1.0, 1.0) for k in range(10, 18)))[0]
    assert words() == []


def test_a_step_that_may_be_a_patch_is_named_as_both():
    (text,) = words((Step(0, 70, -58.1, 9.0, sure=False),))
    assert text == (
        "either range steps by -58.1 m at 7 s, or readings beside it are a patch of outliers: "
        "the estimate takes them for good"
    )


def test_errors_on_one_side_in_words():
    known, unknown = words(one_sided=(OneSided(0, 0.52, 13.0, 5.1, 0.2), OneSided(2, 0.0, 0.0, 0.0, 0.0)))
    assert known == (
        "range errors lie on one side in about 52 % of the readings, by +13 m on average: "
        "the estimate leans to the other side by 5.1 m"
    )
    assert unknown.startswith("elevation errors have two peaks")


def log(time_s):
    """As read: rows in the file's order, sorted by time."""
    order = np.argsort(time_s, kind="stable")
    late = int((np.diff(time_s) < 0).sum())
    return MeasurementLog("log", time_s[order], np.ones((len(time_s), 3)), order, rows_out_of_order=late)


def test_a_clock_set_back_is_seen_and_late_rows_are_not():
    after = np.arange(100) >= 50
    assert faults.clock_set_back(log(TIME - 1.23 * after)) == {"row": 50, "by_s": pytest.approx(-1.13)}
    assert faults.clock_set_back(log(TIME)) is None
    swapped = TIME.copy()
    swapped[[30, 31, 60, 65]] = swapped[[31, 30, 65, 60]]
    assert faults.clock_set_back(log(swapped)) is None
    assert faults.clock_set_back(log(np.r_[TIME[50:], TIME[:50]])) is None  # two files in the wrong order


def test_held_readings_are_said_and_missing_and_do_not_make_a_run_suspect():
    flight = simulate("manoeuvre-clean", seed=3, duration_s=60.0)
    z = flight.log.measurement
    z[:, 2] = z[np.arange(len(z)) // 4 * 4, 2]
    found = pipeline.filter_log(flight.log)
    part = found.metadata["summary"]["components"]["elevation"]
    assert part["held"] == part["missing"] == np.count_nonzero(np.arange(len(z)) % 4)
    assert HELD == 1
    assert found.metadata["summary"]["trust"]["verdict"] == CONSISTENT
    assert f"elevation repeats the reading before in {part['held']} rows" in " ".join(
        faults.allowed_for(found.metadata["summary"])
    )


def test_a_step_makes_a_run_suspect_and_widens_the_sigmas_of_the_side_that_is_moved():
    flight = simulate("manoeuvre-clean", seed=3, duration_s=60.0)
    before = pipeline.filter_log(flight.log, FilterSettings(smooth=True))
    k = 800
    flight.log.measurement[k:, 0] += 25.0 * flight.sigma[0]
    found = pipeline.filter_log(flight.log, FilterSettings(smooth=True))
    trust = found.metadata["summary"]["trust"]
    assert trust["verdict"] == SUSPECT
    assert trust["reasons"][0].startswith("range steps by +")
    wider = found.sigma[:, :3] / before.sigma[:, :3]
    assert np.median(wider[k + 50 :]) > 1.2 > np.median(wider[: k - 50])


def test_a_method_without_sigmas_is_held_against_the_screening():
    flight = simulate("manoeuvre-clean", seed=4, duration_s=30.0)
    flight.log.measurement[100::60, 0] += 8.0 * flight.sigma[0]
    summary = pipeline.filter_log(flight.log, FilterSettings(method="rkf")).metadata["summary"]
    assert summary["trust"]["verdict"] != CONSISTENT
    assert 0 <= summary["screened_out_but_used"] <= summary["screened_out"]
    assert summary["screened_out"] >= 5
