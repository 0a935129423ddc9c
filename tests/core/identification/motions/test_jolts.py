"""Abrupt changes of the acceleration."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.core.filtering.smoother import likelihood_of, smooth_log
from ftproc.core.identification.motions import jolts
from ftproc.core.identification.profile import fit_profile, with_allowance
from ftproc.core.model.frames import from_cartesian
from ftproc.core.model.motion import NO_JOLTS, Jolts, isotropic
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate
from tests.core.identification.test_likelihood import level
from tests.core.tracks import matched

pytestmark = pytest.mark.compiled

AT, STEP_MPS2 = 300, np.array([30.0, -20.0, 10.0])  # sample, and acceleration from it on


def stepped(seed, step=STEP_MPS2):
    """A quiet flight whose acceleration changes at once."""
    a = matched(seed, 600, dt=0.05, q=0.01)
    after = np.maximum(a.time - a.time[AT], 0.0)[:, None]
    truth = a.truth + np.hstack([after**2 / 2 * step, after * step, (after > 0) * step])
    noise = a.z - from_cartesian(a.truth[:, :3])
    return a._replace(z=from_cartesian(truth[:, :3]) + noise, truth=truth)


def with_profile(a):
    return with_allowance(a.log, fit_profile(a.log, a.starts, level(a), 8))


def test_a_change_is_process_noise_between_two_samples():
    """As with a profile that has a knot for every interval."""
    a = matched(1, 80, q=2.0)
    change = Jolts(a.time[[30, 31, 60]], np.array([400.0, 100.0, 9.0]))
    jerk = np.repeat(isotropic(2.0), 79, 0)
    jerk[[29, 30, 59]] = change.variance[:, None] / 0.1
    found, expected = (
        smooth_log(a.log, model, a.starts)
        for model in (a.model._replace(jolts=change), a.model._replace(jerk=jerk, knot_s=0.1 * (1 + 1e-9)))
    )
    np.testing.assert_allclose(found.state, expected.state, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.sigma, expected.sigma, rtol=1e-9)
    assert found.log_likelihood == pytest.approx(expected.log_likelihood, abs=1e-8)
    part = slice(31, 60)  # begins and ends between two changes
    inside = a.model._replace(jolts=change).profile(a.time[part])
    assert len(inside.jolt_s) == 0


def test_changes_add_up_and_shares_of_one_are_one():
    one = Jolts(np.array([1.0, 1.1, 5.0]), np.array([1.0, 3.0, 2.0]))
    both = one + Jolts(np.array([1.1, 9.0]), np.array([4.0, 1.0]))
    np.testing.assert_array_equal(both.time_s, [1.0, 1.1, 5.0, 9.0])
    np.testing.assert_array_equal(both.variance, [1.0, 7.0, 2.0, 1.0])
    assert one.changes_s(0.5) == pytest.approx([1.075, 5.0])
    assert NO_JOLTS.changes_s(0.5) == []


def test_a_profile_loses_its_peaks_alone():
    quiet = np.exp(np.arange(60) / 30.0)
    jerk = quiet.copy()
    jerk[20:23] *= 1e3
    jerk[40:] *= 1e3  # lasts
    found, peaks = jolts.without_peaks(jerk)
    assert peaks == [(20, 23)]
    np.testing.assert_allclose(found[40:], jerk[40:], rtol=1e-12)
    assert (found[20:23] < 3 * quiet[20:23]).all()


@pytest.mark.parametrize("seed", range(4))
def test_a_step_of_the_acceleration_is_told_and_placed(seed):
    a = stepped(seed)
    model = with_profile(a)
    found = jolts.told(a.log, a.starts, model)
    assert found is not None
    (time_s,) = found.jolts.changes_s(found.knot_s)
    assert abs(time_s - a.time[AT]) < 0.2
    assert likelihood_of(a.log, found, a.starts) > likelihood_of(a.log, model, a.starts)
    near = slice(AT - 20, AT + 20)
    before, after = (
        np.sqrt(((smooth_log(a.log, each, a.starts).state - a.truth)[near, 3:6] ** 2).sum(1).mean())
        for each in (model, found)
    )
    assert after < 0.85 * before


def test_a_flight_of_white_jerk_has_none():
    for seed in range(6):
        a = matched(seed, 600, dt=0.05, q=[0.01, 10.0][seed % 2])
        assert jolts.told(a.log, a.starts, with_profile(a)) is None


def test_more_readings_do_not_speak_for_a_change_that_is_slow():
    """Over three seconds: a profile follows that better."""
    a = matched(0, 600, dt=0.05, q=0.01)
    share = np.clip((a.time - a.time[AT]) / 3.0, 0.0, 1.0)
    acceleration = share[:, None] * STEP_MPS2
    velocity = np.cumsum(0.05 * acceleration, 0)
    truth = a.truth[:, :3] + np.cumsum(0.05 * velocity, 0)
    a = a._replace(z=from_cartesian(truth) + a.z - from_cartesian(a.truth[:, :3]))
    assert jolts.told(a.log, a.starts, with_profile(a)) is None


def test_motors_and_canopies_leave_their_times_in_the_summary(monkeypatch):
    """Velocity with the changes against velocity without."""
    ratios = []
    for seed in (501, 504, 511):
        flight = simulate("abrupt", seed=seed, dt_s=0.1)
        found = pipeline.filter_log(flight.log, FilterSettings(smooth=True))
        with monkeypatch.context() as without:
            without.setattr(jolts, "told", lambda *_: None)
            old = pipeline.filter_log(flight.log, FilterSettings(smooth=True))
        assert old.metadata["summary"]["abrupt_changes_s"] == []
        assert 1 <= len(found.metadata["summary"]["abrupt_changes_s"]) <= 2
        wrong = [((each.state[:, 3:6] - flight.truth.velocity_mps) ** 2).sum(1).mean() for each in (found, old)]
        ratios.append(np.sqrt(wrong[0] / wrong[1]))
    assert max(ratios) < 0.7


def test_a_profile_that_the_user_gives_has_none():
    flight = simulate("abrupt", seed=501, dt_s=0.1)
    found = pipeline.filter_log(flight.log, FilterSettings(smooth=True, jerk_psd_m2ps5=100.0))
    assert found.metadata["summary"]["abrupt_changes_s"] == []
