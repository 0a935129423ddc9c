"""Score and information of a step: the slope and the bend of the likelihood by its size, and what a step leaves."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.records import Observations, Start
from ftproc.core.filtering.shifts import shifts
from ftproc.core.filtering.smoother import score_log
from ftproc.core.model.frames import from_cartesian
from tests.core.tracks import SIGMA, matched

pytestmark = pytest.mark.compiled


@pytest.mark.parametrize(("c", "k"), [(0, 30), (1, 12), (2, 55)])
def test_score_and_information_are_slope_and_bend_of_the_likelihood(c, k):
    a = matched(3, 80, dt=0.4, q=4.0, irregular=True, missing=0.2, distance=40_000.0)
    score, information, _ = shifts(a.log, a.model, a.starts)
    size = 0.02 * SIGMA[c]

    def likelihood(shift):
        z = a.z.copy()
        z[k + 1 :, c] -= shift
        return score_log(Observations(a.time, z, a.weight), a.model, a.starts).log_likelihood

    low, middle, high = (likelihood(shift) for shift in (-size, 0.0, size))
    assert score[k, c] == pytest.approx((high - low) / (2 * size), rel=2e-2, abs=1e-2 / SIGMA[c])
    assert information[k, c] == pytest.approx((2 * middle - high - low) / size**2, rel=2e-2)


def test_nothing_is_said_of_a_step_after_the_last_sample():
    a = matched(4, 20, dt=0.5)
    score, information, _ = shifts(a.log, a.model, a.starts)
    assert not score[-1].any()
    assert not information[-1].any()
    assert (information[:-1] > 0).all()


def test_a_jump_of_the_clock_is_found_with_its_size_and_its_sigma():
    """Over many flights the estimate is off by its sigma."""
    off = []
    for seed in range(40):
        a = matched(seed, 120, dt=0.25, q=0.3, distance=8000.0)
        k, late = 60, 0.03  # so little that the way at the jump is known all the same
        moved = a.truth[:, :3] + late * a.truth[:, 3:6] + 0.5 * late**2 * a.truth[:, 6:]
        z = a.z.copy()
        z[k:] += from_cartesian(moved)[k:] - from_cartesian(a.truth[:, :3])[k:]
        score, information, _ = shifts(Observations(a.time, z, a.weight), a.model, a.starts)
        off.append((score[k - 1, 3] / information[k - 1, 3] - late) * np.sqrt(information[k - 1, 3]))
    assert np.sqrt(np.mean(np.square(off))) < 1.5


def test_without_a_step_the_scores_have_the_variance_that_they_state():
    found = []
    for seed in range(60):
        a = matched(seed, 60, dt=0.5, distance=30_000.0)
        score, information, _ = shifts(a.log, a.model, a.starts)
        found.append(score[30] / np.sqrt(information[30]))
    assert np.sqrt(np.mean(np.square(found), 0)) == pytest.approx(1.0, abs=0.3)


def test_each_stretch_between_starts_speaks_for_itself():
    a = matched(5, 400, dt=0.2)
    later = Start(250, a.truth[250], a.starts[0].covariance)
    both = shifts(a.log, a.model, [*a.starts, later])
    alone = [
        shifts(part.log, part.model, part.starts)
        for part in (a.part(slice(250), a.starts), a.part(slice(250, None), [later._replace(sample=0)]))
    ]
    for found, *parts in zip(both, *alone, strict=True):
        np.testing.assert_allclose(found, np.concatenate(parts), rtol=1e-9)
