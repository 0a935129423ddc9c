"""The recursive gate: its weights and its false alarms."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import gate, track
from ftproc.core.filtering import forward
from ftproc.core.filtering.records import Observations
from tests import naive
from tests.core.tracks import SIGMA, matched, position_error


def edit(a, z=None, starts=None, allowed=None, **settings):
    """The run, and the samples at which the filter was re-initialized."""
    starts = starts or a.starts
    log = Observations(a.time, a.z if z is None else z, a.weight if allowed is None else allowed)
    run, made = track.filter_and_edit(log, a.model, starts, gate.GateSettings(**settings))
    assert made[0] is starts[0]
    return run, [start.sample for start in made[1:]]


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
        run = forward.filter_log(a.log, a.model, a.starts)
        of_track = run.innovation_sigma**2 - SIGMA**2
        beyond.append(np.abs(run.innovation) > 3 * run.innovation_sigma)
        literal.append(np.abs(run.innovation) > 3 * np.sqrt(of_track / 18 + SIGMA**2))
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


def test_barred_readings_are_not_used():
    a = matched(4, 100)
    allowed = np.ones((100, 3))
    allowed[5:30, 1] = 0
    assert not edit(a, allowed=allowed)[0].weight[5:30, 1].any()


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
