"""Decisions made again where a missed patch has raised the process noise."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import reassessment, two_pass
from ftproc.core.editing.lasting import settling
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.identification import nearby, profile
from ftproc.core.identification.profile import median_level
from tests.core.editing.test_two_pass import UNKNOWN, edit, flags
from tests.simulated import simulate

pytestmark = pytest.mark.compiled


def test_reassessment_finds_the_patch_that_made_the_jerk_jump(monkeypatch):
    """A ramp in elevation at the very beginning; without reassessment it passes for a manoeuvre."""
    spec = "isolated=0.03:6-300,offset=2:8-30:8-200,ramp=1:10-30:20-200,burst=1:8-20:10-100,nan=0.01,gap=1:2-4"
    flight = simulate("manoeuvre", seed=7, duration_s=75.0, outliers=spec)

    def rms():
        error = edit(flight).smoothed().state[:, :3] - flight.truth.position_m
        return np.sqrt((error**2).sum(1).mean())

    assert rms() < 0.7
    monkeypatch.setattr(two_pass, "reassess_rejected", lambda record, decision, work: (decision, ()))
    reassessed = rms()
    monkeypatch.setattr(two_pass, "reassess", lambda record, decision: decision)
    monkeypatch.setattr(settling, "search", lambda scene: [])  # which finds it, too
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


def test_spans_that_are_passed_over_would_stay_as_they_are(monkeypatch):
    """All spans decided one by one give the same decisions, but for a reading or two."""
    flight = simulate("manoeuvre", seed=6, duration_s=600.0)
    some = edit(flight).weight
    taken, passed = [], reassessment._doubtful

    def spy(record, decision, at_median, spans):
        taken.append((len(list(passed(record, decision, at_median, spans))), len(spans)))
        return spans

    monkeypatch.setattr(reassessment, "_doubtful", spy)
    assert (some != edit(flight).weight).sum() <= 3
    assert taken[0][0] < 0.5 * taken[0][1]


@pytest.fixture(scope="module")
def decided():
    """A record without outliers, and the decisions on it before they are reassessed."""
    flight = simulate("cruise", seed=2, duration_s=40.0)
    found = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(two_pass, "reassess", lambda *each: found.append(each) or each[1])
        two_pass.edit(flight.log.time_s, flight.log.measurement, UNKNOWN)
    return found[0]


def without(decision, share):
    """The decisions with a share of the good readings rejected, here and there."""
    weight = decision.weight.copy()
    weight[np.random.default_rng(0).random(weight.shape) < share] = 0.0
    return decision._replace(weight=weight)


def test_of_two_ways_to_understand_a_log_the_likelier_one_is_taken(decided):
    record, right = decided
    wrong = without(right, 0.15)
    assert reassessment.likelier((record, right), (record, wrong))[1] is right
    assert reassessment.likelier((record, wrong), (record, right))[1] is right
    assert reassessment.likelier((record, right), (record, right))[1] is right


@pytest.mark.parametrize("share", [0.05, 0.15])
def test_decisions_that_make_the_whole_record_less_likely_are_refused(decided, monkeypatch, share):
    """Whatever a round decides; and what makes it likelier stays."""
    record, right = decided
    wrong = without(right, share)
    suspect = np.zeros_like(right.weight, bool)
    suspect[100, 0] = True  # so that a round is made
    monkeypatch.setattr(reassessment, "_suspects", lambda *_: suspect)
    for before, again in ((right, wrong), (wrong, right)):
        rounds = iter([again])
        monkeypatch.setattr(
            reassessment, "decide", lambda *_, tune_first, rounds=rounds, last=again: next(rounds, last)
        )
        found = reassessment._until_settled(record, before, reassessment.with_profile(record, before))
        np.testing.assert_array_equal(found.weight, right.weight)
        assert next(rounds, None) is None


def test_what_is_suspicious_in_one_component_is_decided_again(decided, monkeypatch):
    record, decision = decided
    settled = []
    whole = reassessment._until_settled
    monkeypatch.setattr(reassessment, "_until_settled", lambda *each: settled.append(each[0]) or whole(*each))
    monkeypatch.setattr(nearby, "AROUND", (20, 20))
    suspect = np.zeros_like(decision.weight, bool)
    monkeypatch.setattr(reassessment, "_suspects", lambda *_: suspect)
    reassessment.reassess(record, decision)
    assert not settled
    suspect[150, 1] = True
    monkeypatch.setattr(reassessment, "_suspects", lambda part, *_: suspect[: len(part.time_s)])
    monkeypatch.setattr(reassessment, "suspicious", lambda time_s, *_: suspect[130 : 130 + len(time_s)])
    reassessment.reassess(record, decision)
    assert [part.time_s[0] <= record.time_s[150] <= part.time_s[-1] for part in settled] == [True]


def test_where_a_component_is_missing_around_what_is_marked_all_of_the_log_is_smoothed(decided):
    """The stretch around it alone says nothing of that component."""
    record, decision = decided
    weight, marked = decision.weight.copy(), np.zeros(len(decision.weight), bool)
    weight[150:650, 1], marked[395:405] = 0.0, True
    residual, variance = nearby.residuals_near(record.weighted(weight), decision.model, marked, 200)
    starts = profile.starts_of(record.weighted(weight), median_level(decision.model))
    whole = smooth_log(record.weighted(weight), decision.model, starts)
    np.testing.assert_array_equal(residual, whole.residual)
    np.testing.assert_array_equal(variance, whole.residual_variance)
