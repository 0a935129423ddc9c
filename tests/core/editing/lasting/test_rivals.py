"""Other understandings that are nearly as likely: how the log would be, and what the sigmas make of it."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.core.editing.lasting.faults import MOST, MOTION, PATCH, STEP, Rival, Step, others
from ftproc.settings import FilterSettings
from tests.core.editing.lasting.scenes import N, scene
from tests.trust import hard


def logs(*rivals, steps=(), whole=None):
    whole = whole or scene()
    return list(others(whole.log, whole.possible, whole.at_median, whole.setting, steps, rivals, whole.log.weight))


def test_of_a_patch_that_may_be_motion_the_readings_are_used_and_the_other_way_round():
    whole = scene((1, 50, 60), (1, 80, 90))
    (used,) = logs(Rival(1, 50, 60, 1.0, PATCH, MOTION), whole=whole)
    assert (used.weight[50:60, 1] == 1).all()
    assert (used.weight[80:90, 1] == 0).all()
    (left,) = logs(Rival(1, 60, 80, 1.0, MOTION, PATCH), whole=whole)
    assert (left.weight[50:90, 1] == 0).all()
    assert (left.weight[:, 0] == 1).all()


def test_a_step_that_may_be_a_patch_is_not_taken_out_and_one_that_may_be_is():
    step = Step(0, 120, 7.0, 0.1)
    (patch,) = logs(Rival(0, 100, 120, 1.0, STEP, PATCH, step), steps=(step,))
    assert (patch.measurement == 0).all()
    assert (patch.weight[100:120, 0] == 0).all()
    (moved,) = logs(Rival(0, 100, 120, 1.0, PATCH, STEP, step))
    assert (moved.measurement[120:, 0] == -7).all()
    assert (moved.measurement[:120] == 0).all()


def test_the_likeliest_are_looked_at():
    rivals = [Rival(0, k, k + 4, float(k), MOTION, PATCH) for k in range(50, 10, -4)]
    found = logs(*rivals)
    assert [int(np.flatnonzero(each.weight[:, 0] == 0)[0]) for each in found] == [14 + 4 * k for k in range(MOST)]
    assert len(found[0].weight) == N


@pytest.mark.compiled
def test_sigmas_reach_halfway_to_where_another_understanding_puts_the_target():
    """An azimuth that creeps away by 14 sigmas and comes back at once, or steps for good: of a fighter at 2 Hz nobody
    can tell."""
    creeps = hard.make("ramp", 3).simulated
    found = pipeline.filter_log(creeps.log, FilterSettings(smooth=True))
    trust = found.metadata["summary"]["trust"]
    assert trust["verdict"] == "suspect"
    assert (np.abs(found.state[:, :3] - creeps.truth.position_m) < 5 * found.sigma[:, :3]).mean() > 0.99
