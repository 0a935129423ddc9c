"""Rejected readings at the end of a window: a patch, or a track that was wrong."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import outlier_chain
from ftproc.core.live import readmission
from ftproc.core.live.readmission import Open
from tests.core.tracks import matched

RATES = np.tile(np.array(outlier_chain.START_RATES), (3, 1))


def case(rejected, patch=slice(0), components=(0,), sigmas=15.0):
    """A track whose last readings are rejected, some of which are off."""
    a = matched(3, 120, q=2.0)
    z, weight = a.z.copy(), a.weight.copy()
    for c in components:
        weight[-rejected:, c] = 0.0
        z[patch, c] += sigmas * np.sqrt(a.model.noise_variance[c])
    log = a.log._replace(measurement=z, weight=weight)
    return Open(log, np.isfinite(z), a.model, a.starts[0], RATES)


@pytest.mark.parametrize("components", [(0,), (2,), (0, 1), (0, 1, 2)])
def test_good_readings_are_taken_again(components):
    found = readmission.readmitted(case(12, components=components))
    np.testing.assert_array_equal(found, 1.0)


def test_a_patch_is_not_taken_again():
    assert readmission.readmitted(case(12, slice(108, 120), sigmas=40.0)) is None


def test_after_a_patch_its_second_half_may_be_good():
    """And nothing else changes."""
    open_ = case(24, slice(96, 108), sigmas=40.0)
    found = readmission.readmitted(open_)
    expected = open_.log.weight.copy()
    expected[108:, 0] = 1.0
    np.testing.assert_array_equal(found, expected)


def test_runs_that_are_too_short_or_over_are_left():
    assert readmission.readmitted(case(2)) is None
    over = case(12)
    over.log.weight[-1, 0] = 1.0
    assert readmission.readmitted(over) is None


@pytest.mark.parametrize("good", [True, False])
def test_readings_that_are_not_possible_stay_out(good):
    open_ = case(12)
    open_.possible[-4:, 0] = False
    if not good:
        open_.log.weight[:, 0] = 0.0
    found = readmission.readmitted(open_)
    np.testing.assert_array_equal(found[-4:, 0], 0.0)
    np.testing.assert_array_equal(found[:-4] if good else found[60:-4], 1.0)


@pytest.mark.parametrize("patch", [slice(40, 41), slice(60, 72)])
def test_decisions_stand_still_where_the_outliers_are_left_out(patch):
    """From decisions that reject all ranges, and from themselves; a reading that is not possible stays out."""
    open_ = case(120, patch, sigmas=40.0)
    open_.possible[10, 2] = False
    expected = np.ones_like(open_.log.weight)
    expected[patch, 0] = expected[10, 2] = 0.0
    found = readmission.settled(open_, 4.0)
    np.testing.assert_array_equal(found.log.weight, expected)
    np.testing.assert_array_equal(readmission.settled(found, 4.0).log.weight, expected)
