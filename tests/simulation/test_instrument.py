"""Noise and constant errors of the simulated instrument."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.records import FloatArray
from ftproc.simulation import InstrumentErrors, simulate
from ftproc.simulation.flights.kinematics import Flight, constant_acceleration
from ftproc.simulation.instrument import readable, servo_lag, systematic, unit_noise


def test_correlated_noise_has_the_stated_correlation_and_variance() -> None:
    time = np.cumsum(np.random.default_rng(1).uniform(0.05, 0.15, 60000))
    noise = unit_noise(time, 1.5, None, np.random.default_rng(2))
    assert noise.shape == (60000, 3)
    np.testing.assert_allclose(noise.std(axis=0), 1.0, atol=0.04)
    for lag in (1, 5, 15):
        measured = np.mean(noise[lag:] * noise[:-lag])
        assert measured == pytest.approx(np.exp(-lag * 0.1 / 1.5), abs=0.05)


def test_correlated_noise_equals_the_recursion_written_out() -> None:
    time = np.array([0.0, 0.1, 0.4, 0.4, 2.0])
    white = np.random.default_rng(3).standard_normal((5, 3))
    noise = unit_noise(time, 0.7, None, np.random.default_rng(3))
    for c in range(3):
        x = white[0, c]
        assert noise[0, c] == x
        for k in range(1, 5):
            f = np.exp(-(time[k] - time[k - 1]) / 0.7)
            x = f * x + (1 - f * f) ** 0.5 * white[k, c]
            assert noise[k, c] == pytest.approx(x)


def test_tails_have_unit_variance_and_are_heavier() -> None:
    noise = unit_noise(np.arange(100000.0), 0.0, 6.0, np.random.default_rng(2))
    np.testing.assert_allclose(noise.std(axis=0), 1.0, rtol=0.02)
    assert np.mean(noise**4) > 4  # 3 for a Gaussian, 6 for six degrees of freedom


def test_perfect_instrument_reads_the_truth() -> None:
    position = np.array([[1000.0, -2000.0, 500.0], [-1.0, 1e-9, 3.0]])
    np.testing.assert_array_equal(systematic(position, InstrumentErrors()), from_cartesian(position))


def test_instrument_errors_to_first_order() -> None:
    rng = np.random.default_rng(0)
    position = rng.uniform(-5000, 5000, (200, 3))
    position[:, 2] = rng.uniform(100, 5000, 200)
    r, a, e = from_cartesian(position).T
    small, towards = 1e-5, 0.7

    def off(errors: InstrumentErrors) -> FloatArray:
        d = systematic(position, errors) - np.stack([r, a, e], axis=1)
        d[:, 1] = wrap(d[:, 1])
        return np.asarray(d)

    zero = np.zeros(200)
    cases = [
        (InstrumentErrors(range_zero_m=3.0), (zero + 3, zero, zero)),
        (InstrumentErrors(azimuth_zero_rad=small), (zero, zero + small, zero)),
        (InstrumentErrors(elevation_zero_rad=small), (zero, zero, zero + small)),
        (InstrumentErrors(collimation_rad=small), (zero, small / np.cos(e), zero)),
        (InstrumentErrors(azimuth_eccentricity_rad=small), (zero, small * np.sin(a), zero)),
        (
            InstrumentErrors(azimuth_ellipticity_rad=small, circle_zero_rad=towards),
            (zero, small * np.sin(2 * (a - towards)), zero),
        ),
        (
            InstrumentErrors(elevation_eccentricity_rad=small, elevation_ellipticity_rad=-small),
            (zero, zero, small * (np.sin(e) - np.sin(2 * e))),
        ),
        (
            InstrumentErrors(range_walk_m=2.0, range_walk_at_m=3000.0),
            (2 * np.log(1 + (r / 3000) ** 4), zero, zero),
        ),
        (
            InstrumentErrors(mislevel_rad=small, mislevel_azimuth_rad=towards),
            (zero, small * np.sin(a - towards) * np.tan(e), small * np.cos(a - towards)),
        ),
    ]
    for errors, expected in cases:
        np.testing.assert_allclose(off(errors), np.stack(expected, axis=1), atol=2e-8)


def test_refraction_equals_the_integral_through_flat_layers() -> None:
    """The ray of apparent elevation E0: n cos(elevation) is constant, n - 1 = N exp(-h/H)."""
    n0, scale = 2.8e-4, 8000.0
    for apparent, top in ((0.1, 3000.0), (0.3, 12000.0), (1.0, 500.0), (0.5, 0.5)):
        h = np.linspace(0.0, top, 20001)
        layer = np.arccos((1 + n0) / (1 + n0 * np.exp(-h / scale)) * np.cos(apparent))
        slope = 1 / np.tan(layer)
        ground = float(np.sum((slope[1:] + slope[:-1]) / 2 * np.diff(h)))
        true = np.arctan2(top, ground)
        reading = systematic(np.array([[ground, 0.0, top]]), InstrumentErrors(refraction=n0))
        assert reading[0, 2] - true == pytest.approx(apparent - true, rel=0.02, abs=1e-9)


def test_refraction_is_smooth_through_the_horizon() -> None:
    height = np.linspace(-50.0, 50.0, 1001)
    position = np.stack([np.full(1001, 20e3), np.zeros(1001), height], axis=1)
    lift = systematic(position, InstrumentErrors(refraction=2.8e-4))[:, 2] - from_cartesian(position)[:, 2]
    assert np.isfinite(lift).all()
    assert lift[500] == pytest.approx(2.8e-4 * 20e3 / 8000 / 2)
    assert np.abs(np.diff(lift, 2)).max() < 1e-9


def test_simulate_applies_the_instrument() -> None:
    plain = simulate("manoeuvre-clean", seed=1)
    biased = simulate("manoeuvre-clean", seed=1, instrument=InstrumentErrors(range_zero_m=25.0))
    np.testing.assert_allclose(biased.log.measurement[:, 0] - plain.log.measurement[:, 0], 25.0)
    np.testing.assert_array_equal(biased.truth.position_m, plain.truth.position_m)


def test_readable_edges() -> None:
    shown = readable(np.array([[-3.0, np.pi, 2.0], [5.0, -np.pi - 1e-17, -2.0], [1.0, 4.0, 0.1], [np.nan] * 3]))
    np.testing.assert_array_equal(shown[:2], [[0.0, -np.pi, np.pi / 2], [5.0, -np.pi, -np.pi / 2]])
    np.testing.assert_allclose(shown[2], [1.0, 4.0 - 2 * np.pi, 0.1])
    assert np.isnan(shown[3]).all()


def test_a_servo_is_behind_by_rates_and_accelerations_of_its_angles() -> None:
    """Of a steady circle round the station the azimuth's rate is constant; it passes +-180 degrees."""
    step, rate = 0.001, 0.7
    angle = 3.0 + rate * step * np.arange(2001)
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    flight = Flight(
        0.0, step, 5000 * circle, 5000 * rate * np.roll(circle, 1, 1) * (-1, 1, 0), -5000 * rate**2 * circle
    )
    found = servo_lag(flight, np.linspace(0.2, 1.8, 9), InstrumentErrors(servo_lag_s=0.02, servo_lag_s2=0.5))
    np.testing.assert_allclose(found, np.tile([0.0, 0.02 * rate, 0.0], (9, 1)), atol=2e-5)
    falling = constant_acceleration(10.0, np.array([1000.0, 0, 0]), np.zeros(3), np.array([0.0, 0, 2.0]))
    found = servo_lag(falling, np.array([0.05]), InstrumentErrors(servo_lag_s2=0.5))
    np.testing.assert_allclose(found, [[0.0, 0.0, 0.5 * 2.0 / 1000.0]], rtol=1e-3)
    assert not servo_lag(falling, np.array([5.0]), InstrumentErrors()).any()
