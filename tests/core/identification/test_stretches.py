"""Stretches of a log in one sweep against each by itself, and what lies around a few places against all of the log."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.smoother import RESIDUALS, smooth_log
from ftproc.core.identification import nearby, stretches
from ftproc.core.identification.profile import median_level
from tests.core.tracks import matched

SPANS = [slice(20, 90), slice(91, 150), slice(230, 300)]


def of(a, spans=SPANS):
    return stretches.stretches_of(a.log, spans, a.model.noise_variance, float(a.model.jerk[0, 0]))


@pytest.mark.parametrize("missing", [0.0, 0.3])
def test_stretches_in_one_sweep_are_those_smoothed_one_by_one(missing):
    a = matched(1, 300, missing=missing)
    found = of(a)
    assert found.samples.tolist() == [k for span in SPANS for k in range(300)[span]]
    together = smooth_log(found.log, a.model, found.starts)
    begin = 0
    for span in SPANS:
        part = a.log.part(span)
        alone = smooth_log(part, a.model, find_starts(part, a.model.noise_variance, 1.0))
        for name in ("state", "sigma", "residual", "residual_variance"):
            rows = getattr(together, name)[begin : begin + len(part.time_s)]
            np.testing.assert_allclose(rows, getattr(alone, name), rtol=1e-9, atol=1e-12, err_msg=name)
        begin += len(part.time_s)


def test_a_stretch_that_does_not_see_a_component_is_left_out():
    a = matched(2, 300)
    a.weight[SPANS[1], 2] = 0.0
    found = of(a)
    assert found.samples.tolist() == [k for span in (SPANS[0], SPANS[2]) for k in range(300)[span]]
    assert [start.sample for start in found.starts] == [0, 70]
    assert of(a, [SPANS[1]]) is None


@pytest.mark.parametrize("around", [0, 1, 7, 400])
def test_what_is_marked_is_widened_as_in_plain_words(around):
    marked = np.random.default_rng(around).random(300) < 0.02
    plain = [marked[max(k - around, 0) : k + around + 1].any() for k in range(300)]
    np.testing.assert_array_equal(stretches.widened(marked, around), plain)


@pytest.mark.parametrize(("pieces", "most"), [(1, 0.025), (12, 0.05)])
def test_residuals_near_a_few_places_are_those_of_all_of_the_log(pieces, most):
    a = matched(3, 1500, pieces=pieces)
    marked = np.zeros(1500, bool)
    marked[[400, 405, 1100, 1450]] = True
    around = nearby.samples_around(a.log, median_level(a.model))
    residual, variance = nearby.residuals_near(a.log, a.model, marked, around)
    whole = smooth_log(a.log, a.model, a.starts, RESIDUALS)
    off = np.abs(residual - whole.residual) / np.sqrt(whole.residual_variance)
    assert off[marked].max() < most
    np.testing.assert_allclose(variance[marked], whole.residual_variance[marked], rtol=most)
    assert np.isnan(residual[700:800]).all()
    assert np.isnan(nearby.residuals_near(a.log, a.model, np.zeros(1500, bool), around)).all()
