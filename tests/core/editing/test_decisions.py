"""When what is rejected are the tails of the noise, and what is kept in any case."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ftproc.core.editing import decisions
from ftproc.core.filtering.records import Model
from ftproc.core.filtering.smoother import RESIDUALS, smooth_log
from ftproc.core.identification.coloured_noise import Coloured
from tests.core.tracks import matched

GATE, SAMPLES = 4.0, 2000


def residuals(near=0, far=0, outliers=0, run=1):
    """Residuals in sigmas, so many of which lie just outside the gate, farther out, and very far, in runs."""
    off = np.ones((SAMPLES, 3))
    places = iter(range(10, SAMPLES, 10))
    for count, size in ((near, 1.2 * GATE), (far, 1.7 * GATE), (outliers, 30 * GATE)):
        for _ in range(count):
            first = next(places)
            off[first : first + run, 0] = size
    return off


@pytest.mark.parametrize(
    ("of", "tails"),
    [
        ({"near": 60}, True),
        ({"near": 45, "far": 15}, True),
        ({"near": 25}, False),  # so few are none
        ({"near": 20, "far": 40}, False),  # tails become thinner with the distance
        ({"near": 40, "outliers": 60}, False),  # most are outliers
        ({"near": 60, "outliers": 30}, True),
        ({"near": 60, "run": 2}, False),  # tails come alone
    ],
)
def test_tails_lie_just_outside_the_gate_alone_and_ever_fewer(of, tails):
    off = residuals(**of)
    assert decisions._has_tails(off, GATE, off.size) == tails


def test_a_large_share_of_the_readings_is_no_tail():
    off = np.ones((SAMPLES, 3))
    off[::4] = 1.2 * GATE
    assert not decisions._has_tails(off, GATE, off.size)


def test_a_component_keeps_what_screening_trusts_if_almost_nothing_is_left():
    screened = np.ones((10, 3))
    decided = screened.copy()
    decided[:6, 0] = decided[:5, 1] = 0.0
    kept = decisions._keep_most(decided, screened)
    np.testing.assert_array_equal(kept[:, 0], 1.0)
    np.testing.assert_array_equal(kept[:, 1:], decided[:, 1:])


@pytest.mark.parametrize("settled", [True, False])
def test_decisions_under_correlated_noise_are_taken_only_if_they_stand_still(monkeypatch, settled):
    before = decisions.Decision(np.ones((4, 3)), Model(np.ones(3), np.ones((1, 6))), [], np.ones((3, 3)))
    slower, faster = (before.model._replace(tau_s=np.full(3, tau_s)) for tau_s in (2.0, 1.0))
    found = Coloured(before.model, faster, slower, True, True, True)
    after = before._replace(weight=np.zeros((4, 3)), model=faster, slowest=slower, settled=settled)
    monkeypatch.setattr(decisions, "smooth_log", lambda *args, **options: None)
    monkeypatch.setattr(decisions, "decide", lambda record, decision, tune_first: after)
    monkeypatch.setattr(decisions.coloured_noise, "may_be", lambda *args: True)
    monkeypatch.setattr(decisions.coloured_noise, "fit_coloured", lambda *args: found)
    record = SimpleNamespace(weighted=lambda weight: None, fixed=None, uneven=None, rounding=np.zeros(3))
    decided = decisions.allow_for_colour(record, before)
    assert decided.model is faster
    assert decided.slowest is slower
    np.testing.assert_array_equal(decided.weight, after.weight if settled else before.weight)


def test_a_log_is_smoothed_again_only_around_what_has_changed_sides(monkeypatch):
    """With the same model; with another one, all of it."""
    a = matched(5, 12_000, q=30.0)
    whole = decisions._smoothed(a.log, a.model, a.starts, None)
    weight = a.weight.copy()
    weight[[700, 701, 2900], [0, 0, 2]] = 0.0
    changed = a.log._replace(weight=weight)
    swept = []
    smooth = decisions.smoothed_near
    monkeypatch.setattr(decisions, "smoothed_near", lambda *each: swept.append(1) or smooth(*each))
    found = decisions._smoothed(changed, a.model, a.starts, whole)
    exact = smooth_log(changed, a.model, a.starts, RESIDUALS)
    assert swept
    sigma = np.sqrt(exact.residual_variance)
    assert (np.abs(found.residuals.residual - exact.residual) / sigma).max() < 0.02
    np.testing.assert_allclose(np.sqrt(found.residuals.variance), sigma, rtol=0.01)
    assert (found.residuals.residual == whole.residuals.residual).mean() > 0.9
    other = a.model._replace(jerk=1.01 * a.model.jerk)
    np.testing.assert_array_equal(
        decisions._smoothed(changed, other, a.starts, whole).residuals.residual,
        smooth_log(changed, other, a.starts, RESIDUALS).residual,
    )
    assert len(swept) == 1
    assert decisions._smoothed(a.log, a.model, a.starts, whole).residuals is whole.residuals
