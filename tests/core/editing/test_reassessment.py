"""Decisions made again where a missed patch has raised the process noise."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import reassessment, two_pass
from tests.core.editing.test_two_pass import edit, flags
from tests.simulated import simulate

pytestmark = pytest.mark.compiled


def test_reassessment_finds_the_patch_that_made_the_jerk_jump(monkeypatch):
    """A ramp in elevation at the very beginning; without reassessment it passes for a manoeuvre."""
    spec = "isolated=0.03:6-300,offset=2:8-30:8-200,ramp=1:10-30:20-200,burst=1:8-20:10-100,nan=0.01,gap=1:2-4"
    flight = simulate("manoeuvre", seed=7, duration_s=75.0, outliers=spec)

    def rms():
        error = edit(flight).smoothed.state[:, :3] - flight.truth.position_m
        return np.sqrt((error**2).sum(1).mean())

    reassessed = rms()
    monkeypatch.setattr(two_pass, "reassess", lambda record, decision: decision)
    assert reassessed < 0.7
    assert rms() > 3 * reassessed


def test_long_log_is_reassessed_in_spans_only(monkeypatch):
    """The same outliers are found as with all of it reassessed, though little of it is."""
    spec = "isolated=0.03:6-300,range.patch=12:15-40:4-7"
    flight = simulate("manoeuvre", seed=5, duration_s=500.0, outliers=spec)
    assert len(flight.log) > reassessment.SHORT_LOG
    spans = []
    whole = reassessment._until_settled

    def spy(record, decision, profile):
        spans.append(len(record.time_s))
        return whole(record, decision, profile)

    monkeypatch.setattr(reassessment, "_until_settled", spy)
    in_spans = edit(flight)
    assert 0 < sum(spans) < len(flight.log)
    assert max(spans) <= 1.5 * reassessment.LONGEST_SPAN
    monkeypatch.setattr(reassessment, "SHORT_LOG", 10**6)
    monkeypatch.setattr(reassessment, "MOST", 0.0)
    entire = edit(flight)
    assert (in_spans.weight != entire.weight).mean() < 0.002
    rejected, large, good = flags(flight, in_spans)
    assert rejected[large].mean() > 0.98
    assert rejected[good].mean() < 0.002
