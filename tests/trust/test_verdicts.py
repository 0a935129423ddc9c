"""A fault that once went unnoticed: the tracker locks on another lobe during a short loss of track."""

from __future__ import annotations

import pytest

from ftproc import pipeline
from ftproc.quality.verdict import CONSISTENT
from ftproc.settings import FilterSettings
from tests.trust import faulty_logs


@pytest.mark.parametrize("smooth", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_step_of_both_angles_after_a_short_gap_is_named(smooth: bool) -> None:
    log = faulty_logs.make("another lobe", 13).simulated.log
    found = pipeline.filter_log(log, FilterSettings(smooth=smooth)).metadata["summary"]
    assert found["trust"]["verdict"] != CONSISTENT
    assert {step["component"] for step in found["steps"]} == {"azimuth", "elevation"}
