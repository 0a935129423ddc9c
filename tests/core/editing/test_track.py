"""The gated recursion over a log: bursts, dropouts, biases and wrong starts do not lock it out."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing.track import REACQUIRE_SAMPLES, reacquire
from ftproc.core.filtering import forward
from ftproc.core.filtering.records import Start
from ftproc.core.model.frames import from_cartesian, wrap
from tests import naive
from tests.core.editing.test_gate import edit, spoiled
from tests.core.tracks import SIGMA, matched, position_error


def burst(a):
    z = a.z.copy()
    z[150:180] += np.random.default_rng(1).normal(0, 40, (30, 3)) * SIGMA
    return z


def dropout(a):
    z = a.z.copy()
    z[(a.time >= 15) & (a.time < 75)] = np.nan
    return z


TROUBLE = {
    "burst of 30 samples in all components": burst,
    "offset of 30 samples in range": lambda a: spoiled(a, slice(150, 180), np.array([50.0, 0, 0])),
    "dropout of 60 s": dropout,
    "wrong first sample": lambda a: spoiled(a, 0, np.full(3, 100.0)),
    "six wrong first samples": lambda a: spoiled(a, slice(0, 6), np.full(3, 100.0)),
}


@pytest.mark.parametrize("trouble", TROUBLE)
@pytest.mark.parametrize("seed", range(4))
def test_recovers(trouble, seed):
    a = matched(seed, 1000, q=20.0)
    clean = position_error(edit(a)[0].state, a.truth)[-100:].mean()
    run, _ = edit(a, TROUBLE[trouble](a))
    assert position_error(run.state, a.truth)[-100:].mean() < 1.05 * clean
    assert (run.weight[-100:] > 0).mean() > 0.99
    assert (run.sigma > 0).all()


@pytest.mark.parametrize("components", [(0,), (1,), (0, 1, 2)])
@pytest.mark.parametrize("seed", range(4))
def test_step_bias_is_followed_in_the_end(components, seed):
    """A bias that stays is no patch: after the longest patch the readings are accepted again."""
    a = matched(seed, 500, q=20.0)
    error = np.zeros(3)
    error[list(components)] = 40.0
    run, _ = edit(a, spoiled(a, slice(200, None), error))
    assert not run.weight[200:220, components].any()
    late = slice(300, None)
    assert (run.weight[late] > 0).mean() > 0.99
    residual = from_cartesian(run.state[late, :3]) - from_cartesian(a.truth[late, :3])
    residual[:, 1] = wrap(residual[:, 1])
    np.testing.assert_allclose((residual / SIGMA).mean(0), error, atol=3)


def test_wrong_first_state_is_replaced():
    a = matched(3, 300, q=20.0)
    wrong = Start(0, a.truth[0] + np.r_[500.0, -300, 200, np.zeros(6)], a.starts[0].covariance)
    run, again = edit(a, starts=[wrong])
    assert len(again) == 1
    assert position_error(run.state, a.truth)[-100:].mean() < 5
    assert run.since_start[again[0]] == 0


def test_samples_before_the_start_are_extrapolated():
    a = matched(5, 100)
    run, _ = edit(a, starts=[Start(20, a.truth[20], a.starts[0].covariance)])
    assert not run.weight[:20].any()
    assert np.isfinite(run.state).all()
    np.testing.assert_allclose(run.state[0], naive.transition(-2.0) @ a.truth[20], rtol=1e-9)


def test_record_after_a_start_does_not_know_the_one_before():
    a = matched(9, 200, q=20.0)
    again = Start(120, a.truth[120], a.starts[0].covariance)
    run, made = edit(a, spoiled(a, slice(90, 120), np.full(3, 50.0)), starts=[a.starts[0], again])
    alone, _ = edit(a.part(slice(120, None), [again._replace(sample=0)]))
    assert made[-1] == 120
    np.testing.assert_allclose(run.state[120:], alone.state, rtol=1e-12)
    np.testing.assert_array_equal(run.weight[120:], alone.weight)
    np.testing.assert_array_equal(run.since_start[120:], np.arange(80))


def test_longest_patch_is_the_one_specified():
    a = matched(6, 300, q=0.1)
    z = spoiled(a, slice(100, 160), np.full(3, 60.0))  # 6 s
    assert len(edit(a, z, longest_patch_s=4.0)[1]) > 0
    run, again = edit(a, z, longest_patch_s=20.0)
    assert again == []
    assert not run.weight[100:160].any()


@pytest.mark.parametrize("samples", [10, 60, 200])
def test_a_track_is_re_acquired_from_the_newest_readings_alone(samples):
    """What came before them, and what comes after, says nothing; fewer, at the beginning, do as well."""
    a = matched(8, 260, q=20.0)
    noise, sample = a.model.noise_variance, samples - 1
    used = slice(max(samples - REACQUIRE_SAMPLES, 0), samples)
    z = spoiled(a, slice(0, used.start), np.full(3, 500.0))
    z = spoiled(a._replace(z=z), slice(samples, None), np.full(3, 500.0))
    found = reacquire(a.time, z, noise, sample)
    alone = reacquire(a.time[used], a.z[used], noise, sample - used.start)
    assert found.sample == sample
    np.testing.assert_array_equal(found.state, alone.state)
    np.testing.assert_array_equal(found.covariance, alone.covariance)
    sigma = np.sqrt(np.diag(found.covariance))
    assert (np.abs(found.state - a.truth[sample]) < 5 * sigma).all()


def test_likelihood_is_that_of_the_readings_used():
    """Of a run without outliers under a wide gate: that of the filter without a gate, from each start on."""
    a = matched(2, 200)
    again = Start(120, a.truth[120], a.starts[0].covariance)
    starts = [a.starts[0], again]
    run, _ = edit(a, starts=starts, gate=100.0)
    plain = forward.filter_log(a.log, a.model, starts)
    assert run.log_likelihood == pytest.approx(plain.log_likelihood, rel=1e-9)
