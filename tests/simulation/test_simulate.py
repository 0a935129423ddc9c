"""Simulated flights: the truth is a flight, the log is one that a station could have made."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.errors import UsageError
from ftproc.simulation import list_scenarios, simulate
from ftproc.simulation.flights.aircraft import path_acceleration
from ftproc.simulation.flights.kinematics import smoothed
from tests.simulated import codes, deviation, load_factor

#: Scenarios whose accelerations are those of an aircraft with a pilot, in still air.
FLOWN = [name for name in list_scenarios() if name not in ("abrupt", "aerodynamic", "ballistic", "release")]


def test_zuo2021_is_the_papers_flight() -> None:
    flight = simulate("zuo2021", seed=5)
    assert len(flight.log) == 61
    t = flight.truth.time_s
    np.testing.assert_array_equal(t, np.arange(61.0))
    for axis, (p, v, a) in enumerate(((300, 40, 1.3), (346, 20, 1.7), (200, 10, 1.3))):
        np.testing.assert_allclose(flight.truth.position_m[:, axis], p + v * t + a * t * t / 2, rtol=1e-13)
    assert flight.sigma == pytest.approx((10**0.5, 2e-4, 2e-4))
    assert not codes(flight).any()


def test_zuo2021_noise_has_the_stated_variance() -> None:
    noise = np.concatenate(
        [
            (s := simulate("zuo2021", seed=seed)).log.measurement - from_cartesian(s.truth.position_m)
            for seed in range(60)
        ]
    )
    noise[:, 1] = wrap(noise[:, 1])
    n = len(noise)
    for sample, sigma in zip(noise.T, (10**0.5, 2e-4, 2e-4), strict=True):
        assert abs(sample.mean()) < 4 * sigma / n**0.5
        assert sample.var() == pytest.approx(sigma**2, rel=4 * (2 / n) ** 0.5)
    correlation = np.corrcoef(noise.T)[np.triu_indices(3, 1)]
    assert np.abs(correlation).max() < 4 / n**0.5


def test_zuo2021_outliers_are_in_range_alone_and_as_large_as_said() -> None:
    spikes = 0
    for seed in range(40):
        flight = simulate("zuo2021-outliers", seed=seed)
        code, off = codes(flight), deviation(flight)
        assert not code[:, 1:].any()
        assert not off[:, 1:].any()
        patch = np.flatnonzero(code[:, 0] == 2)
        assert len(patch) == 6
        np.testing.assert_array_equal(np.diff(patch), 1)
        # range is never negative, so a large negative error of a near target may be cut
        uncut = flight.log.measurement[:, 0] > 0
        np.testing.assert_allclose(np.abs(off[patch, 0][uncut[patch]]), 150.0, rtol=1e-9)
        spike = (code[:, 0] == 1) & uncut
        assert ((np.abs(off[spike, 0]) >= 20) & (np.abs(off[spike, 0]) <= 200)).all()
        spikes += int((code[:, 0] == 1).sum())
    assert spikes == pytest.approx(40 * 55 * 0.1, rel=0.25)


@pytest.mark.parametrize("name", FLOWN)
@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4, 5])
def test_truth_is_consistent(name: str, seed: int) -> None:
    """Velocity is the derivative of position and acceleration that of velocity, by Simpson's rule over 2 dt."""
    flight = simulate(name, seed=seed, duration_s=40.0, dt_s=0.01, outliers="none")
    truth, dt = flight.truth, 0.01
    assert truth.velocity_mps is not None
    assert truth.acceleration_mps2 is not None
    for upper, lower in (
        (truth.position_m, truth.velocity_mps),
        (truth.velocity_mps, truth.acceleration_mps2),
    ):
        area = dt / 3 * (lower[:-2] + 4 * lower[1:-1] + lower[2:])
        np.testing.assert_allclose(upper[2:] - upper[:-2], area, atol=1e-2 * dt)


@pytest.mark.parametrize("name", list(list_scenarios()))
@pytest.mark.parametrize("seed", range(8))
def test_log_is_a_log(name: str, seed: int) -> None:
    flight = simulate(name, seed=seed)
    log, truth = flight.log, flight.truth
    n = len(log)
    assert n >= 50
    np.testing.assert_array_equal(log.time_s, truth.time_s)
    assert (np.diff(log.time_s) >= 0).all()
    np.testing.assert_array_equal(log.row, np.arange(n))
    assert log.rows_in_file == n
    assert log.duplicate_times == n - len(np.unique(log.time_s))
    assert truth.position_m.shape == log.measurement.shape == codes(flight).shape == (n, 3)
    r, a, e = log.measurement.T
    assert not (r < 0).any()
    assert not ((a < -np.pi) | (a >= np.pi)).any()
    assert not (np.abs(e) > np.pi / 2).any()
    assert (truth.position_m[:, 2] > 0).all()


@pytest.mark.parametrize("name", FLOWN)
@pytest.mark.parametrize("seed", range(12))
def test_acceleration_is_an_aircrafts(name: str, seed: int) -> None:
    flight = simulate(name, seed=seed, outliers="none")
    felt, dt = load_factor(flight), np.diff(flight.log.time_s).mean()
    assert felt.max() < 5.5
    assert flight.truth.acceleration_mps2 is not None
    assert np.linalg.norm(flight.truth.acceleration_mps2, axis=1).max() < 5.5 * 9.80665
    jerk = np.diff(flight.truth.acceleration_mps2, axis=0) / dt  # 5 g one way to 5 g the other in a second: 200
    assert np.linalg.norm(jerk, axis=1).max() < 250


def test_manoeuvre_is_lively_and_each_seed_another() -> None:
    flights = [simulate("manoeuvre", seed=seed) for seed in range(20)]
    peaks = [load_factor(flight).max() for flight in flights]
    assert np.median(peaks) > 3.5
    assert max(peaks) > 4.5
    starts = {tuple(flight.truth.position_m[0]) for flight in flights}
    assert len(starts) == 20
    climbs = [float(np.ptp(flight.truth.position_m[:, 2])) for flight in flights]
    assert np.median(climbs) > 300
    for flight in flights:
        assert 2300 <= len(flight.log) < 2401  # one gap
        kinds = set(np.unique(codes(flight)))
        assert {1, 2, 3, 4, 5} <= kinds
        assert np.isnan(flight.log.measurement).any()
        assert 2 <= flight.sigma[0] <= 5
        assert 1e-4 <= flight.sigma[1] <= 3e-4


def test_manoeuvre_clean_is_the_same_flight_with_the_same_noise() -> None:
    dirty, clean = simulate("manoeuvre", seed=7), simulate("manoeuvre-clean", seed=7)
    rows = np.searchsorted(clean.log.time_s, dirty.log.time_s)
    np.testing.assert_array_equal(clean.truth.position_m[rows], dirty.truth.position_m)
    np.testing.assert_array_equal(clean.log.measurement[rows], dirty.clean)
    assert not codes(clean).any()
    assert not np.isnan(clean.log.measurement).any()
    assert len(clean.log) == 2401


def test_radar_is_a_radars() -> None:
    for seed in range(10):
        flight = simulate("radar", seed=seed)
        distance = np.linalg.norm(flight.truth.position_m, axis=1)
        assert distance.min() > 20e3
        assert distance.max() < 160e3
        assert 600 - 1 <= flight.log.time_s[-1] <= 900 + 1
        step = np.diff(flight.log.time_s)
        assert step.max() >= 7.5  # the gap
        assert np.std(step[(step > 0.5) & (step < 1.5)]) == pytest.approx(0.4 / 6**0.5, rel=0.15)  # jitter
        assert flight.log.duplicate_times in (4, 5)  # one may have fallen on another's neighbour
        assert 20 <= flight.sigma[0] <= 30


def test_overhead_goes_beyond_85_degrees() -> None:
    for seed in range(10):
        elevation = from_cartesian(simulate("overhead", seed=seed).truth.position_m)[:, 2]
        assert np.deg2rad(85) < elevation.max() < np.deg2rad(90)


def test_calibration_circles_through_the_cut() -> None:
    azimuth = from_cartesian(simulate("calibration", seed=1).truth.position_m)[:, 1]
    assert (np.abs(np.diff(azimuth)) > np.pi).any()


def test_family_covers_rates_noise_and_outliers() -> None:
    flights = [simulate("family", seed=seed) for seed in range(60)]
    steps = {round(float(np.median(np.diff(f.log.time_s))), 2) for f in flights}
    assert {0.02, 1.0} <= steps
    assert len(steps) >= 5
    noises = [f.sigma[0] for f in flights]
    assert min(noises) < 2
    assert max(noises) > 20
    assert {*range(8)} == {int(c) for f in flights for c in np.unique(codes(f))}


def test_a_long_flight_stays_in_its_area() -> None:
    flight = simulate("manoeuvre", seed=2, duration_s=20000.0, dt_s=1.0, outliers="none")
    position = flight.truth.position_m
    assert (position[:, 2] > 0).all()
    assert position[:, 2].max() < 12e3
    assert np.linalg.norm(position, axis=1).max() < 60e3
    assert flight.truth.velocity_mps is not None
    speed = np.linalg.norm(flight.truth.velocity_mps, axis=1)
    assert speed.min() > 135
    assert speed.max() < 295


def test_smoothing_a_command_keeps_what_it_adds_up_to() -> None:
    profile = np.zeros((300, 2))
    profile[100:150] = [2.0, -1.0]
    rounded = smoothed(profile, 31)
    assert rounded.shape == profile.shape
    np.testing.assert_allclose(rounded.sum(axis=0), profile.sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(rounded[120:130], profile[120:130], rtol=1e-12)
    assert np.abs(np.diff(rounded[:, 0])).max() < 2.0 * 2.1 / 31
    np.testing.assert_allclose(smoothed(np.ones((50, 1)), 8), 1.0, rtol=1e-12)


def test_path_acceleration_is_the_derivative_of_the_velocity() -> None:
    t = np.linspace(0.0, 10.0, 2001)
    speed, climb, heading = 150 + 3 * t, 0.3 * np.sin(t), 0.2 * t**2
    rate = np.stack([np.full_like(t, 3.0), 0.3 * np.cos(t), 0.4 * t], axis=1)
    flat = speed * np.cos(climb)
    velocity = np.stack([flat * np.cos(heading), flat * np.sin(heading), speed * np.sin(climb)], axis=1)
    numerical = (velocity[2:] - velocity[:-2]) / (t[2:] - t[:-2])[:, None]
    np.testing.assert_allclose(path_acceleration(speed, climb, heading, rate)[1:-1], numerical, atol=0.1)


@pytest.mark.parametrize("name", list(list_scenarios()))
def test_same_seed_same_bytes(name: str) -> None:
    one, two, other = (simulate(name, seed=seed) for seed in (11, 11, 12))
    assert one.log.time_s.tobytes() == two.log.time_s.tobytes()
    assert one.log.measurement.tobytes() == two.log.measurement.tobytes()
    assert one.truth.position_m.tobytes() == two.truth.position_m.tobytes()
    assert codes(one).tobytes() == codes(two).tobytes()
    assert one.log.measurement.tobytes() != other.log.measurement.tobytes()


@pytest.mark.parametrize("name", list(list_scenarios()))
def test_every_scenario_takes_every_override(name: str) -> None:
    flight = simulate(name, seed=3, duration_s=50.0, dt_s=0.1, noise=(7.0, 0.001, 0.002), outliers="nan=0.5")
    assert len(flight.log) == 501
    assert flight.log.time_s[3] == 0.3  # printed as such
    assert flight.log.time_s[-1] == 50.0
    assert flight.sigma == (7.0, 0.001, 0.002)
    error = flight.clean - from_cartesian(flight.truth.position_m)
    error[:, 1] = wrap(error[:, 1])
    below_zenith = np.abs(flight.clean[:, 2]) < 1.55
    np.testing.assert_allclose(error[below_zenith].std(axis=0), (7.0, 0.001, 0.002), rtol=0.15)
    measured = 3 if np.isfinite(flight.log.measurement[:, 2]).any() else 2
    assert np.isnan(flight.log.measurement[:, :measured]).mean() == pytest.approx(0.5, abs=0.06)


def test_noise_free_log_is_the_truth_and_outliers_keep_their_size() -> None:
    flight = simulate("manoeuvre", seed=1, noise=(0.0, 0.0, 0.0), outliers="isolated=0.1:10")
    np.testing.assert_allclose(flight.clean, from_cartesian(flight.truth.position_m), atol=1e-9)
    hit = codes(flight)[:, 0] == 1
    usual = simulate("manoeuvre", seed=1).sigma[0]
    np.testing.assert_allclose(np.abs(deviation(flight)[hit, 0]), 10 * usual, rtol=1e-6)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"scenario": "acrobatics"}, 'There is no scenario "acrobatics". Choose one of zuo2021, zuo2021-outliers,'),
        ({"seed": -1}, "The seed must be a whole number from 0, not -1."),
        ({"seed": 1.5}, "The seed must be a whole number from 0, not 1.5."),
        ({"duration_s": 0.0}, "The duration must be a positive number of seconds, not 0."),
        ({"duration_s": float("nan")}, "The duration must be a positive number of seconds, not nan."),
        ({"dt_s": -1.0}, "The sample interval must be a positive number of seconds, not -1."),
        ({"dt_s": 61.0}, "The sample interval, 61 s, is longer than the record, 60 s."),
        ({"duration_s": 1e6}, "The duration is at most 100000 s, not 1e+06 s."),
        ({"dt_s": 1e-6}, "60 s at 1e-06 s are 60000001 rows; at most 10000000 are made."),
        ({"noise": (1.0, -1.0, 0.0)}, "The noise is three numbers from 0: range in m, azimuth and elevation in rad"),
        ({"noise": (1.0, 2.0)}, "such as 5,0.0002,0.0002; not 1,2."),
        ({"noise": (1.0, float("inf"), 0.0)}, "not 1,inf,0."),
    ],
)  # fmt: skip
def test_bad_arguments_are_refused_in_a_sentence(arguments: dict[str, object], sentence: str) -> None:
    with pytest.raises(UsageError) as caught:
        simulate(**({"scenario": "zuo2021"} | arguments))  # type: ignore[arg-type]
    assert sentence in str(caught.value)


def test_scenarios_have_one_line_descriptions() -> None:
    scenarios = list_scenarios()
    assert {"zuo2021", "zuo2021-outliers", "manoeuvre", "manoeuvre-clean", "radar", "overhead", "family"} <= set(
        scenarios
    )
    for text in scenarios.values():
        assert 20 < len(text) <= 100
        assert "\n" not in text
