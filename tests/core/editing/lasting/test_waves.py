"""Waves, of an instrument or of the target."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import two_pass
from ftproc.core.editing.lasting import between, waves
from ftproc.core.editing.lasting.curves import Curve, without
from ftproc.core.editing.lasting.waves import likeliest_wave
from ftproc.core.filtering.records import Model
from tests import drone
from tests.core.editing.lasting.scenes import N, scene
from tests.trust import hard

UNKNOWN = two_pass.Known(np.full(3, np.nan), None, 4.0)


def edited(log, position_m):
    """How a log is edited, and the root mean square of its errors, m."""
    found = two_pass.edit(log.time_s, log.measurement, UNKNOWN)
    return found, np.sqrt(((found.smoothed().state[:, :3] - position_m) ** 2).sum(1).mean())


def swinging(rate_radps, decay_per_s, begin, end, components):
    """A scene at whose readings there is noise of one, and a wave of ten in some components."""
    some, rng = scene(), np.random.default_rng(7)
    since_s = some.log.time_s[begin:end] - some.log.time_s[begin]
    z = np.array([1e3, 0.0, 0.0]) + rng.standard_normal((N, 3)) * np.array([1.0, 1e-3, 1e-3])
    for c in components:
        size = np.array([10.0, 1e-2, 1e-2])[c]
        z[begin:end, c] += size * np.exp(-decay_per_s * since_s) * np.cos(rate_radps * since_s + c)
    model = Model(np.array([1.0, 1e-6, 1e-6]), np.full((1, 3), 1e-6))
    return some._replace(log=some.log._replace(measurement=z), at_median=model, own=model)


def test_a_wave_is_taken_out_of_the_readings():
    some = scene()
    curve = Curve(1, 50, 80, (3e-3, -1e-3), wave=(0.7, 0.1))
    since_s = np.arange(30.0)
    off = without(np.zeros((N, 3)), some.setting, [curve])
    swings = np.exp(-0.1 * since_s) * (3e-3 * np.cos(0.7 * since_s) - 1e-3 * np.sin(0.7 * since_s))
    assert np.allclose(off[50:80, 1], -swings, atol=1e-12)
    off[50:80, 1] = 0
    assert not off.any()


@pytest.mark.parametrize(
    ("rate_radps", "decay_per_s", "begin", "end", "components"), [(0.6, 0.0, 60, 140, (2,)), (0.9, 0.06, 0, 60, (1, 2))]
)
def test_its_rate_and_its_ends_are_found(rate_radps, decay_per_s, begin, end, components):
    part = swinging(rate_radps, decay_per_s, begin, end, components)
    about = [Curve(c, max(begin - 5, 0), end - 10, (0.0, 0.0)) for c in components]
    found = likeliest_wave(part, about)
    assert [curve.component for curve in found] == list(components)
    for curve in found:
        assert curve.wave == pytest.approx((rate_radps, decay_per_s), abs=0.02)
        assert abs(curve.begin - begin) <= 2
        if not decay_per_s:  # what has died away ends anywhere
            assert abs(curve.end - end) <= 2


def test_there_is_none_where_nothing_swings():
    part = swinging(0.6, 0.0, 60, 60, (2,))
    assert likeliest_wave(part, [Curve(2, 60, 140, (0.0, 0.0))]) is None


@pytest.mark.compiled
@pytest.mark.parametrize("of", ["mount", pytest.param("overhead pass", marks=pytest.mark.slow)])
def test_a_wave_of_an_instrument_is_left_out(of, monkeypatch):
    """Both angles of a mount that has just locked on; and an azimuth that swings for 40 s while a target passes
    overhead."""
    if of == "mount":
        log, position_m = drone.locked(305, 0.1)
        bad = np.zeros(log.measurement.shape, bool)
        bad[log.time_s < 0.9 * drone.LOCKING_S, 1:] = True
    else:
        dirty = hard.make("sine", 9).simulated
        log, position_m, bad = dirty.log, dirty.truth.position_m, dirty.truth.outlier > 0
    found, error_m = edited(log, position_m)
    assert found.weight[bad].mean() < 0.02
    assert error_m < 3.0
    monkeypatch.setattr(between, "of_a_wave", lambda *of: None)
    assert edited(log, position_m)[1] > 5.0


@pytest.mark.compiled
@pytest.mark.parametrize(("seed", "rule"), [(306, "is_of_the_target"), (301, "moved")])
def test_a_wave_of_the_target_is_not(seed, rule, monkeypatch):
    """An aircraft that weaves on its way to or from the instrument."""
    log, position_m = drone.weaving(seed, 0.2)
    found, error_m = edited(log, position_m)
    assert found.weight.mean() > 0.99
    assert error_m < 1.2
    monkeypatch.setattr(between, rule, {"is_of_the_target": lambda *of: False, "moved": lambda *of: -np.inf}[rule])
    assert edited(log, position_m)[1] > 5.0


def test_a_target_that_would_need_more_acceleration_than_any_has_did_not_move():
    part = swinging(0.6, 0.0, 60, 140, (0,))
    seen = between.weighed(part, part.log.weight, [Curve(0, 60, 140, (0.0, 0.0), wave=(0.6, 0.0))])
    assert np.isfinite(waves.moved(part, seen))
    far = part._replace(log=part.log._replace(measurement=part.log.measurement * np.array([1e3, 1.0, 1.0])))
    far = far._replace(own=Model(part.own.noise_variance, np.full((1, 3), 1e4)))
    assert waves.moved(far, seen) == -np.inf
