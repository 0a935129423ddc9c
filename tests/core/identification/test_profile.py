"""Process noise that follows the flight."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.records import Model
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.identification.profile import fit_profile, from_knot, of_part
from ftproc.core.model import motion
from ftproc.core.model.frames import from_cartesian
from tests import naive
from tests.core.identification.test_likelihood import level, smoothed_error
from tests.core.tracks import SIGMA, matched

pytestmark = pytest.mark.compiled


def piecewise(seed):
    """Twenty seconds of small jerk, twenty of large jerk, twenty of small jerk."""
    a = matched(seed, 600, q=1.0)
    jerk = np.array([[0.01], [400.0], [0.01]]) * motion.isotropic(1.0)
    rng, truth = np.random.default_rng(seed), a.truth.copy()
    for k in range(1, 600):
        phi, q = naive.transition(0.1), naive.van_loan(0.1, jerk[min(int(a.time[k] / 20.0), 2)])
        truth[k] = phi @ truth[k - 1] + np.linalg.cholesky(q) @ rng.standard_normal(9)
    noise = a.z - from_cartesian(a.truth[:, :3])
    return a._replace(z=from_cartesian(truth[:, :3]) + noise, truth=truth, model=Model(SIGMA**2, jerk, 20.0))


def test_profile_follows_the_flight():
    a = piecewise(0)
    single = level(a)
    profile = fit_profile(a.log, a.starts, single, 15)
    np.testing.assert_array_equal(profile.noise_variance, single.noise_variance)
    knots = len(profile.jerk)
    assert knots > 3
    assert profile.knot_s * knots >= a.time[-1]
    at = profile.knot_s * (np.arange(knots) + 0.5)
    height = profile.jerk[:, 0]
    assert np.median(height[(at > 22) & (at < 38)]) > 30 * np.median(height[(at < 15) | (at > 45)])
    found = [smooth_log(a.log, m, a.starts).log_likelihood for m in (single, profile)]
    assert found[1] > found[0] + 5
    assert smoothed_error(a, profile) < smoothed_error(a, single)


def test_a_stretch_keeps_the_pieces_of_the_profile_that_it_lies_in():
    time = 0.1 * np.arange(600)
    model = Model(SIGMA**2, np.arange(1.0, 21.0)[:, None] * motion.isotropic(1.0), 3.0)
    for low, high in ((0, 600), (95, 250), (240, 241), (570, 700)):
        span, own = from_knot(model, time, slice(low, high))
        whole = model.profile(time)
        part = own.profile(time[span])
        assert span.start <= low < span.start + 31
        assert span.stop == high
        for t in time[low:high]:
            at, of = (p.jerk[motion.knot_index(t + 1e-6, p), 0] for p in (part, whole))
            assert at == of
        assert len(own.jerk) == len({motion.knot_index(t, whole) for t in time[span]})


def test_a_part_has_the_process_noise_of_the_log_to_half_a_knot():
    time = 0.1 * np.arange(600)
    model = Model(SIGMA**2, np.arange(1.0, 21.0)[:, None] * motion.isotropic(1.0), 3.0)
    whole = model.profile(time)
    for low, high in ((0, 600), (95, 250), (240, 242), (570, 600)):
        part = of_part(model, time[low:high] - time[0]).profile(time[low:high])
        for t in time[low:high]:
            near = [whole.jerk[motion.knot_index(t + shift, whole), 0] for shift in (-1.5, 0.0, 1.5)]
            assert min(near) <= part.jerk[motion.knot_index(t, part), 0] <= max(near)
    level = model._replace(jerk=model.jerk[:1], knot_s=np.inf)
    assert of_part(level, time) is level
