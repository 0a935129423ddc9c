"""The main method by its three ways of editing, and the plain filters."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from ftproc.core.filtering import forward
from ftproc.core.filtering.records import Start
from ftproc.methods import anti_outlier, preparing
from ftproc.methods.estimate import Readings
from ftproc.records import GOOD, ISOLATED, MISSING, PATCH
from ftproc.settings import FilterSettings
from tests.simulated import codes, deviation, simulate

UNKNOWN = np.full(3, np.nan)


def readings(flight):
    return Readings(flight.log.time_s, flight.log.measurement, UNKNOWN)


def error(run, flight):
    return np.sqrt(np.nanmean(np.sum((run.state[:, :3] - flight.truth.position_m) ** 2, 1)))


def by(editing, **others):
    """The settings; the paper's gate must wait for the end of the longest patch."""
    return FilterSettings(editing=editing, max_patch_s=3.0 if editing == "forward" else None, **others)


@pytest.fixture(scope="module")
def dirty():
    return simulate("cruise", seed=1, duration_s=90.0, outliers="isolated=0.03:10-200,offset=1:8-20:20-100,nan=0.02")


@pytest.fixture(scope="module")
def clean():
    return simulate("cruise", seed=1, duration_s=90.0, outliers="none")


@pytest.fixture(scope="module")
def edited(dirty):
    """edited("forward", smooth=True) -> the estimate of the dirty flight, made once."""
    return cache(lambda editing, **others: anti_outlier.estimate(readings(dirty), by(editing, **others)))


@pytest.mark.parametrize("editing", ["two-pass", "forward"])
def test_editing_is_nearly_as_good_as_a_clean_log(dirty, clean, edited, editing):
    settings, found = by(editing), edited(editing)
    reference = anti_outlier.estimate(readings(clean), settings)
    assert error(found.run, dirty) < 1.2 * error(reference.run, clean)
    assert error(found.run, dirty) < 0.3 * error(preparing.unedited(readings(dirty), settings).run, dirty)


@pytest.mark.parametrize("editing", ["two-pass", "forward", "none"])
def test_labels_are_complete(dirty, edited, editing):
    found = edited(editing)
    missing = np.isnan(dirty.log.measurement)
    np.testing.assert_array_equal(found.label == MISSING, missing)
    assert found.label.dtype == np.uint8
    assert found.label.shape == dirty.log.measurement.shape
    if editing == "none":
        assert (found.label[~missing] == GOOD).all()
        np.testing.assert_array_equal(found.run.weight, (~missing).astype(float))


@pytest.mark.parametrize("editing", ["two-pass", "forward"])
def test_patches_and_isolated_outliers_are_distinguished(dirty, edited, editing):
    found = edited(editing)
    large = np.abs(deviation(dirty)) > 10 * np.array(dirty.sigma)
    spike = (codes(dirty) == 1) & large
    patch = (codes(dirty) == 2) & large & np.isfinite(dirty.log.measurement)
    assert np.isin(found.label[spike], (ISOLATED, PATCH)).mean() > 0.98
    assert (found.label[spike] == ISOLATED).mean() > 0.7
    # What begins a patch is not yet one when it comes.
    assert (found.label[patch] == PATCH).mean() > (0.95 if editing == "two-pass" else 0.8)


def test_smoother_comes_only_when_asked(dirty, edited):
    for editing in ("two-pass", "forward", "none"):
        if editing != "forward":  # which is filtered as it comes
            assert edited(editing).smoothed is None
        asked = edited(editing, smooth=True)
        assert asked.smoothed is not None
        if editing != "none":
            assert error(asked.smoothed, dirty) < error(asked.run, dirty)


def test_specified_noise_and_jerk_are_used(clean):
    settings = FilterSettings(editing="none", noise=(5.0, 1e-3, 2e-3), jerk_psd_m2ps5=7.0)
    found = anti_outlier.estimate(readings(clean), settings)
    np.testing.assert_allclose(np.sqrt(found.model.noise_variance), (5.0, 1e-3, 2e-3))
    np.testing.assert_allclose(found.model.jerk, 7.0)


def test_assumed_noise_is_used_where_the_log_cannot_tell(clean):
    assumed = readings(clean)._replace(assumed_sigma=np.array([np.nan, 0.5, np.nan]))
    found = preparing.unedited(assumed, FilterSettings())
    assert np.sqrt(found.model.noise_variance[1]) == pytest.approx(0.5)
    assert np.sqrt(found.model.noise_variance[0]) == pytest.approx(clean.sigma[0], rel=0.1)


def test_ekf_and_ukf_agree_on_an_easy_flight(clean):
    plain = preparing.unedited(readings(clean), FilterSettings())
    extended = preparing.unedited(readings(clean), FilterSettings(), extended=True)
    assert not np.array_equal(plain.run.state, extended.run.state)
    assert error(extended.run, clean) == pytest.approx(error(plain.run, clean), rel=0.05)


def test_run_of_two_passes_is_the_plain_filter_over_what_is_good(dirty, edited):
    found = edited("two-pass")
    assert found.settled is not None
    weight = np.where(found.label == GOOD, 1.0, 0.0)
    np.testing.assert_array_equal(found.run.weight, weight)
    seen = found.run.since_start
    start = Start(0, found.run.predicted[0], np.diag(found.run.sigma[0] ** 2))
    again = forward.filter_log(readings(dirty).weighted(weight), found.model, [start])
    np.testing.assert_allclose(again.state[-1], found.run.state[-1], rtol=0.02, atol=1)
    assert (seen == np.arange(len(seen))).all()


def test_lost_lock_is_reported_and_smoothed_on_each_side():
    flight = simulate("cruise", seed=2, duration_s=60.0, outliers="none")
    z = flight.log.measurement.copy()
    z[300:] += [800.0, 0.05, 0.0]  # another target, 40 sigmas and more away
    settings = FilterSettings(editing="forward", smooth=True, noise=flight.sigma, jerk_psd_m2ps5=1.0)
    found = anti_outlier.estimate(Readings(flight.log.time_s, z, UNKNOWN), settings)
    assert len(found.reacquired) >= 1
    assert all(300 < k < 400 for k in found.reacquired)
    assert found.smoothed is not None
    np.testing.assert_allclose(found.smoothed.state[-1, :3], found.run.state[-1, :3], atol=10)
    before = found.smoothed.state[:300, :3] - flight.truth.position_m[:300]
    assert np.linalg.norm(before, axis=1).max() < 10  # one smoother over both would be drawn 90 m away


def test_seed_literal_gain_form_runs(dirty, edited):
    for found in (edited("forward"), edited("forward", gain_form=True)):
        assert error(found.run, dirty) < 3


@pytest.mark.parametrize("rejected", [False, True])
def test_decisions_that_reject_nothing_stand_still(clean, monkeypatch, rejected):
    """Clean hovers were suspect, with no reading flagged that one could have looked at."""
    edit = anti_outlier.two_pass.edit

    def unsettled(*given):
        found = edit(*given)
        weight = found.log.weight.copy()
        weight[50, 0] = 0.0 if rejected else weight[50, 0]
        decision = found.decision._replace(settled=False)
        return found._replace(decision=decision, log=found.log._replace(weight=weight))

    monkeypatch.setattr(anti_outlier.two_pass, "edit", unsettled)
    assert anti_outlier.estimate(readings(clean), FilterSettings()).settled is not rejected
