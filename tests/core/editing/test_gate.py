"""The recursive gate: its weights, its false alarms, and that nothing locks it out."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import gate, track
from ftproc.core.filtering import forward
from ftproc.core.filtering.records import Start
from ftproc.core.model.frames import from_cartesian, wrap
from tests import naive
from tests.core.tracks import SIGMA, matched, position_error


def edit(a, z=None, starts=None, allowed=None, **settings):
    """The run, and the samples at which the filter began anew."""
    z, allowed, starts = a.z if z is None else z, a.weight if allowed is None else allowed, starts or a.starts
    run, begun = track.filter_and_edit(a.time, z, allowed, a.model, starts, gate.GateSettings(**settings))
    assert begun[0] is starts[0]
    return run, [start.sample for start in begun[1:]]


def spoiled(a, rows, error, component=slice(None)):
    z = a.z.copy()
    z[rows, component] += (error * SIGMA)[component]
    return z


def test_igg3_is_continuous_and_redescends():
    assert gate.igg3(0.0, 2.5, 6.0) == 1.0
    assert gate.igg3(2.5, 2.5, 6.0) == 1.0
    assert gate.igg3(6.0, 2.5, 6.0) == 0.0
    assert gate.igg3(1e9, 2.5, 6.0) == 0.0
    assert gate.igg3(4.0, 2.5, 6.0) == pytest.approx(2.5 / 4 * (2 / 3.5) ** 2)
    u = np.linspace(0, 8, 8001)
    m = np.array([gate.igg3(v, 2.5, 6.0) for v in u])
    assert (np.diff(m) <= 0).all()
    assert np.abs(np.diff(m)).max() < 2e-3


def test_rejection_weight_is_the_weight_at_the_gate():
    assert gate.rejection_weight(4.0) == pytest.approx(gate.igg3(4.0, 2.5, 6.0))
    assert gate.rejection_weight(3.0) == pytest.approx(gate.rejection_weight(8.0))


@pytest.mark.parametrize(("dt", "literal_from", "literal_to"), [(1.0, 0.04, 0.11), (0.1, 0.005, 0.012)])
def test_false_alarms_of_a_matched_model(dt, literal_from, literal_to):
    """C = 3 hits 0.27 % of good readings; with the printed 1/(2n) under the root it would be many times that."""
    beyond, literal, rejected = [], [], []
    for seed in range(60):
        a = matched(seed, 120, dt=dt, q=1.0, distance=5e4)
        run = forward.filter_log(a.time, a.z, a.weight, a.model, a.starts)
        track = run.innovation_sigma**2 - SIGMA**2
        beyond.append(np.abs(run.innovation) > 3 * run.innovation_sigma)
        literal.append(np.abs(run.innovation) > 3 * np.sqrt(track / 18 + SIGMA**2))
        rejected.append(edit(a, gate=3.0)[0].weight <= gate.rejection_weight(3.0))
    assert 0.002 <= np.mean(beyond) <= 0.004
    assert literal_from < np.mean(literal) < literal_to
    assert np.mean(rejected) <= 0.004


@pytest.mark.parametrize("seed", range(5))
def test_isolated_outlier_is_rejected_and_forgotten(seed):
    a = matched(seed, 300, q=20.0)
    clean, _ = edit(a)
    run, again = edit(a, spoiled(a, 150, np.array([60.0, 0, 0])))
    assert run.weight[150, 0] == 0
    assert (run.weight[151:, 0] > 0).all()
    np.testing.assert_allclose(position_error(run.state, clean.state)[200:], 0, atol=0.01)
    assert again == []


@pytest.mark.parametrize("component", range(3))
def test_bad_reading_leaves_the_other_components_untouched(component):
    a = matched(1, 200, q=20.0)
    clean, _ = edit(a)
    error = np.zeros(3)
    error[component] = 80.0
    run, _ = edit(a, spoiled(a, slice(100, 105), error))
    others = [c for c in range(3) if c != component]
    assert (run.weight[100:105, component] == 0).all()
    np.testing.assert_array_equal(run.weight[:, others], clean.weight[:, others])
    np.testing.assert_array_equal(run.weight[:100], clean.weight[:100])


def test_outlier_cannot_widen_its_own_gate():
    a = matched(2, 200, q=20.0)
    clean, _ = edit(a)
    run, _ = edit(a, spoiled(a, 100, np.array([1e4, 0, 0])))
    np.testing.assert_array_equal(run.innovation_sigma[:101], clean.innovation_sigma[:101])
    assert (run.innovation_sigma[101:] < 1.2 * clean.innovation_sigma[101:]).all()


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
    """A bias that stays is no patch: after the longest patch the readings are believed again."""
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


def test_barred_readings_are_not_used():
    a = matched(4, 100)
    allowed = np.ones((100, 3))
    allowed[5:30, 1] = 0
    assert not edit(a, allowed=allowed)[0].weight[5:30, 1].any()


def test_samples_before_the_start_are_extrapolated():
    a = matched(5, 100)
    run, _ = edit(a, starts=[Start(20, a.truth[20], a.starts[0].covariance)])
    assert not run.weight[:20].any()
    assert np.isfinite(run.state).all()
    np.testing.assert_allclose(run.state[0], naive.transition(-2.0) @ a.truth[20], rtol=1e-9)


def test_record_after_a_start_does_not_know_the_one_before():
    a = matched(9, 200, q=20.0)
    again = Start(120, a.truth[120], a.starts[0].covariance)
    run, begun = edit(a, spoiled(a, slice(90, 120), np.full(3, 50.0)), starts=[a.starts[0], again])
    rest = a._replace(time=a.time[120:], z=a.z[120:], weight=a.weight[120:])
    alone, _ = edit(rest, starts=[again._replace(sample=0)])
    assert begun[-1] == 120
    np.testing.assert_allclose(run.state[120:], alone.state, rtol=1e-12)
    np.testing.assert_array_equal(run.weight[120:], alone.weight)
    np.testing.assert_array_equal(run.since_start[120:], np.arange(80))


def test_longest_patch_is_what_was_said():
    a = matched(6, 300, q=0.1)
    z = spoiled(a, slice(100, 160), np.full(3, 60.0))  # 6 s
    assert len(edit(a, z, longest_patch_s=4.0)[1]) > 0
    run, again = edit(a, z, longest_patch_s=20.0)
    assert again == []
    assert not run.weight[100:160].any()


def test_gain_form_has_the_covariance_of_any_gain():
    """K' = K m,  x+ = x + K' e,  P+ = P - K' P_xz' - P_xz K'' + K' S K''."""
    a = matched(7, 1)
    x, p = a.starts[0].state, a.starts[0].covariance
    z_hat, c, pxz = naive.unscented(x, p)
    s = c + np.diag(SIGMA**2)
    u = np.array([4.2, 0.0, 3.0])
    z = (z_hat + u * np.sqrt(np.diag(s)))[None]
    m = np.array([gate.igg3(v, 2.5, 6.0) for v in u])
    gain = pxz @ np.linalg.inv(s) * m
    run, _ = edit(a, z, gain_form=True)
    np.testing.assert_allclose(run.weight[0], m, rtol=1e-9)
    np.testing.assert_allclose(run.state[0], x + gain @ naive.difference(z[0], z_hat), rtol=1e-9)
    expected = p - gain @ pxz.T - pxz @ gain.T + gain @ s @ gain.T
    np.testing.assert_allclose(run.sigma[0], np.sqrt(np.diag(expected)), rtol=1e-9)
    noise_form = naive.update(x, p, (z_hat, c, pxz), z[0], SIGMA**2, m)
    np.testing.assert_allclose(edit(a, z)[0].state[0], noise_form[0], rtol=1e-9)


def test_both_forms_agree_on_clean_readings():
    a = matched(8, 200, q=20.0)
    wide = {"gate": 50.0}
    np.testing.assert_allclose(edit(a, **wide)[0].state, edit(a, gain_form=True, **wide)[0].state, rtol=1e-9)
