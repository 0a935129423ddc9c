"""Rejected readings at the end of a window: a patch, or a track that was wrong."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core import odds
from ftproc.core.editing import outlier_chain
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.identification.scales import scales_of
from ftproc.core.live.newest import readmission
from ftproc.core.live.newest.deciding import Deciding
from ftproc.core.live.newest.readmission import Open
from ftproc.core.model.frames import from_cartesian
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
    return Open(log, a.model, a.starts[0], RATES, np.zeros(z.shape, bool), np.isfinite(z), 0.0 * z, 0.0 * z)


def readmitted(open_):
    """The decisions taken instead, with the process noise as it is."""
    found = readmission.readmitted(open_, open_.model, None)
    return None if found is None or found.gain <= odds.LIKELIER else found.case.log.weight


@pytest.mark.parametrize("components", [(0,), (2,), (0, 1), (0, 1, 2)])
def test_good_readings_are_taken_again(components):
    found = readmitted(case(12, components=components))
    np.testing.assert_array_equal(found, 1.0)


def test_a_patch_is_not_taken_again():
    assert readmitted(case(12, slice(108, 120), sigmas=40.0)) is None


def test_after_a_patch_its_second_half_may_be_good():
    """And nothing else changes."""
    open_ = case(24, slice(96, 108), sigmas=40.0)
    found = readmitted(open_)
    expected = open_.log.weight.copy()
    expected[108:, 0] = 1.0
    np.testing.assert_array_equal(found, expected)


def test_runs_that_are_too_short_or_over_are_left():
    assert readmitted(case(2)) is None
    over = case(12)
    over.log.weight[-1, 0] = 1.0
    assert readmitted(over) is None


@pytest.mark.parametrize("good", [True, False])
def test_readings_that_are_not_possible_stay_out(good):
    open_ = case(12)
    open_.possible[-4:, 0] = False
    if not good:
        open_.log.weight[:, 0] = 0.0
    found = readmitted(open_)
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


def turning(begun, off_mps2=4.0):
    """A track that is straight but for its last samples, in which it turns; these are rejected."""
    a = matched(3, 120, dt=0.5, q=1e-6)
    since = np.clip(a.time - a.time[-begun], 0.0, None)
    side = np.cross(a.truth[0, 3:6], [0.0, 0.0, 1.0])
    position = a.truth[:, :3] + 0.5 * off_mps2 * since[:, None] ** 2 * side / np.linalg.norm(side)
    z = a.z + from_cartesian(position) - from_cartesian(a.truth[:, :3])
    weight = a.weight.copy()
    weight[-begun + 2 :, :2] = 0.0
    log = a.log._replace(measurement=z, weight=weight)
    return Open(log, a.model, a.starts[0], RATES, np.zeros(z.shape, bool), np.isfinite(z), 0.0 * z, 0.0 * z), position


@pytest.mark.parametrize("begun", [16, 20])
def test_a_target_that_begins_to_turn_is_followed(begun):
    """With the jerk of a straight leg it is a patch; with the likeliest jerk it is a turn, and the jerk stays."""
    open_, position = turning(begun)
    assert readmitted(open_) is None
    scales = scales_of(open_.log, open_.model.noise_variance)
    found, profile = Deciding().decided(open_, 4.0, open_.model, scales, jumps=True, fresh=1)
    assert found.log.weight[-begun + 2 :].mean() > 0.9
    assert profile.jerk.max() > 1e3 * open_.model.jerk.max()
    run = smooth_log(found.log, found.model, [found.start])
    assert (np.abs(run.state[-begun:, :3] - position[-begun:]) < 4 * run.sigma[-begun:, :3]).all()


def test_a_patch_is_no_turn():
    open_ = case(24, slice(96, 120), (0, 1), sigmas=200.0)
    scales = scales_of(open_.log, open_.model.noise_variance)
    found, profile = Deciding().decided(open_, 4.0, open_.model, scales, jumps=False, fresh=1)
    assert profile is open_.model
    assert not found.log.weight[96:, :2].any()
