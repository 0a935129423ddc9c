"""From a run to inputs and targets and back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftproc.core.model.frames import to_cartesian
from ftproc.correction.feature_sets import FEATURES, named
from ftproc.correction.features import SETTLING, Features, LineOfSight, echo
from ftproc.errors import UsageError
from ftproc.simulation.instrument import InstrumentErrors, systematic
from tests.correction import fake
from tests.simulated import simulate

coordinate = st.floats(-2e5, 2e5)


@given(st.tuples(coordinate, coordinate, coordinate), st.integers(0, 1000))
def test_line_of_sight_mapping_there_and_back(position: tuple[float, float, float], seed: int) -> None:
    los = LineOfSight(np.array([position]), np.ones((1, 6)))
    vector = np.random.default_rng(seed).normal(size=(1, 6))
    along = los.from_cartesian(vector)
    assert los.to_cartesian(along) == pytest.approx(vector, abs=1e-12)
    assert np.linalg.norm(along[:, :3]) == pytest.approx(np.linalg.norm(vector[:, :3]))


@pytest.mark.parametrize(
    ("position", "axis", "towards"),
    [
        ((1000.0, 0.0, 0.0), 0, (1, 0, 0)),
        ((1000.0, 0.0, 0.0), 1, (0, 1, 0)),  # azimuth grows from x to y
        ((1000.0, 0.0, 0.0), 2, (0, 0, 1)),
        ((0.0, -500.0, 0.0), 1, (1, 0, 0)),
        ((0.0, 0.0, 900.0), 0, (0, 0, 1)),  # straight overhead
        ((0.0, 0.0, 900.0), 2, (-1, 0, 0)),
    ],
)
def test_what_lies_along_an_axis(position: tuple[float, ...], axis: int, towards: tuple[int, ...]) -> None:
    los = LineOfSight(np.array([position]), np.ones((1, 6)))
    vector = np.array([[*towards, *(-2 * t for t in towards)]], float)
    expected = np.zeros((1, 6))
    expected[0, axis], expected[0, axis + 3] = 1.0, -2.0
    assert los.from_cartesian(vector) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("features", FEATURES.values(), ids=FEATURES)
def test_adding_the_wanted_output_gives_the_truth(features: Features) -> None:
    flight = fake.flights(0, 1, bias=(1, -1, 0.5, 0, 0.5, 1))[0]
    los = LineOfSight.of(flight.run, 0, 600)
    wanted = features.targets(los, flight.error)
    assert wanted.shape == (600, features.output_size)
    output = np.zeros((600, 6))
    output[:, : features.output_size] = wanted[:, :6]
    corrected = flight.run.state[:, :6] + features.to_cartesian(los, output)
    assert corrected[:, :3] == pytest.approx(flight.truth_position, abs=1e-9)
    assert features.output_size < 6 or corrected[:, 3:] == pytest.approx(flight.truth_velocity, abs=1e-9)
    assert features.from_cartesian(los, features.to_cartesian(los, output)) == pytest.approx(output)
    assert features.unit(los).shape == (600, 6)


def test_the_papers_input_is_update_minus_prediction_and_its_target_truth_minus_estimate() -> None:
    flight = fake.flights(1, 1)[0]
    features = named("correction")
    x, _ = features.inputs(flight.run, 0, 600)
    assert np.array_equal(x[100], flight.run.state[100] - flight.run.predicted[100])
    wanted = features.targets(LineOfSight.of(flight.run, 0, 600), flight.error)
    assert wanted[100, :3] == pytest.approx(flight.truth_position[100] - flight.run.state[100, :3])
    assert (features.input_size, features.output_size) == (9, 9)


def test_the_window_holds_the_last_innovations_over_sigma_and_zero_where_not_used() -> None:
    filtered = fake.without(fake.run(np.random.default_rng(2)), slice(95, 97), [1])
    x, valid = named("window").inputs(filtered, 0, 600)
    assert valid[100]
    ratio = np.where(filtered.weight > 0, filtered.innovation / filtered.innovation_sigma, 0.0)
    for lag in range(8):
        assert np.array_equal(x[100, 3 * lag : 3 * lag + 3], ratio[100 - lag])
    assert x[100, 3 * 5 + 1] == x[100, 3 * 4 + 1] == 0.0
    for place, width in ((24, 8), (27, 16), (30, 32)):
        before = ratio[100 - 2 * width + 1 : 100 - width + 1]
        assert x[100, place : place + 3] == pytest.approx(before.sum(0) / np.sqrt(width), abs=1e-12)


def test_the_window_does_not_reach_before_a_reinitialization() -> None:
    filtered = fake.run(np.random.default_rng(2))
    since = filtered.since_start.copy()
    since[300:] = np.arange(300)
    filtered = filtered._replace(since_start=since)
    x, _ = named("window").inputs(filtered, 0, 600)
    expected, _ = named("window").inputs(filtered.rows(300, 600), 0, 300)
    assert np.array_equal(x[300:], expected)


def test_the_windows_geometry() -> None:
    filtered = fake.run(np.random.default_rng(3))
    x, _ = named("window").inputs(filtered, 0, 600)
    px, py, pz = filtered.state[50, :3]
    flat, distance = np.hypot(px, py), np.sqrt(px**2 + py**2 + pz**2)
    angle = np.array([fake.SIGMA[0], fake.SIGMA[1] / flat, fake.SIGMA[2] / distance])
    ratio = angle / filtered.innovation_sigma[50]
    expected = [np.log(distance), np.arcsin(pz / distance), *np.log(angle), *np.log(ratio)]
    assert x[50, 33:] == pytest.approx(np.array(expected))
    assert named("window").input_size == 41


def test_an_instruments_constant_errors_are_linear_in_its_features() -> None:
    rng = np.random.default_rng(4)
    state = np.zeros((400, 9))
    state[:, :3] = to_cartesian(
        np.stack([rng.uniform(2e3, 9e3, 400), rng.uniform(-3, 3, 400), rng.uniform(0.1, 0.9, 400)], axis=1)
    )
    errors = InstrumentErrors(3.0, 2e-4, -3e-4, 4e-4, 0.7, 5e-4)
    seen = to_cartesian(systematic(state[:, :3], errors))
    features = named("instrument")
    run = fake.run(rng, n=400)._replace(state=state)
    x, _ = features.inputs(run, 0, 400)
    los = LineOfSight.of(run, SETTLING, 400)
    target = features.targets(los, np.concatenate([state[:, :3] - seen, np.zeros((400, 6))], axis=1)[SETTLING:])
    columns = np.concatenate([x[SETTLING:], np.ones((400 - SETTLING, 1))], axis=1)
    left = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    assert np.sqrt((target**2).mean(0)).min() > 1e-4
    assert (np.abs(left).max(0) < [5e-3, 2e-6, 2e-6]).all()  # m, rad, rad: second order in the errors


@pytest.mark.parametrize("features", FEATURES.values(), ids=FEATURES)
def test_any_cut_of_a_run_gives_the_same_inputs(features: Features) -> None:
    filtered = fake.without(fake.run(np.random.default_rng(4), n=100), slice(40, 60))
    whole, mask = features.inputs(filtered, 0, 100)
    for cut in (1, 3, 7, 8, 50, 63, 64, 65, 99):
        parts = [features.inputs(filtered, 0, cut), features.inputs(filtered, cut, 100)]
        assert np.array_equal(np.concatenate([p[0] for p in parts]), whole)
        assert np.array_equal(np.concatenate([p[1] for p in parts]), mask)


@pytest.mark.parametrize("features", FEATURES.values(), ids=FEATURES)
def test_valid_is_false_while_coasting_settling_or_without_numbers(features: Features) -> None:
    filtered = fake.without(fake.run(np.random.default_rng(5)), slice(100, 110))
    filtered = fake.without(filtered, slice(200, 210), [0, 1])  # elevation still there: not coasting
    since = filtered.since_start.copy()
    since[300:] = np.arange(300)
    state, sigma = filtered.state.copy(), filtered.los_sigma.copy()
    state[400, 7] = np.nan
    sigma[410, 2] = 0.0
    sigma[420, 5] = np.inf
    run = filtered._replace(since_start=since, state=state, los_sigma=sigma)
    x, valid = features.inputs(run, 0, 600, signal_db=np.full(600, 20.0))
    expected = np.ones(600, bool)
    expected[:SETTLING] = expected[300 : 300 + SETTLING] = expected[100:110] = False
    expected[[400, 410, 420]] = False
    assert np.array_equal(valid, expected)
    assert not x[~valid].any()
    assert np.isfinite(x).all()


def test_angles_only_logs_have_inputs_too() -> None:
    x, valid = named("window").inputs(fake.without(fake.run(np.random.default_rng(6)), slice(None), [0]), 0, 600)
    assert valid[SETTLING:].all()
    assert not x[:, 0:33:3].any()


@pytest.mark.parametrize("features", FEATURES.values(), ids=FEATURES)
def test_an_empty_run(features: Features) -> None:
    x, valid = features.inputs(fake.run(np.random.default_rng(0), n=0), 0, 0)
    assert x.shape == (0, features.input_size)
    assert valid.shape == (0,)


def test_an_unknown_feature_set_is_named_with_the_known_ones() -> None:
    with pytest.raises(UsageError, match=r"no feature set 'wndow'.*correction, window"):
        named("wndow")


def test_motion_looks_no_farther_back_than_the_last_initialization() -> None:
    filtered = fake.run(np.random.default_rng(2))
    filtered.state[:, 6:] = np.random.default_rng(3).normal(size=(600, 3))
    since = filtered.since_start.copy()
    since[300:] = np.arange(300)
    filtered = filtered._replace(since_start=since)
    x, _ = named("motion").inputs(filtered, 0, 600)
    expected, _ = named("motion").inputs(filtered.rows(300, 600), 0, 300)
    assert x[300 + SETTLING :] == pytest.approx(expected[SETTLING:], abs=1e-12)
    assert expected[SETTLING:].any(axis=0).sum() > 50


def test_motion_has_no_unit_of_length() -> None:
    """A flight twice as far and as fast, with sigmas twice as large, has the same inputs but for the load and the logs
    of speed and of the sigma of the acceleration."""
    filtered = fake.run(np.random.default_rng(2))
    filtered.state[:, 6:] = np.random.default_rng(3).normal(size=(600, 3))
    unit = np.array([2.0, 1.0, 1.0])
    twice = filtered._replace(
        state=2 * filtered.state, sigma=2 * filtered.sigma, los_sigma=2 * filtered.los_sigma,
        innovation=unit * filtered.innovation, innovation_sigma=unit * filtered.innovation_sigma,
    )  # fmt: skip
    one, other = (named("motion").inputs(run, 0, 600)[0] for run in (filtered, twice))
    differ = np.flatnonzero(np.abs(one - other).max(axis=0) > 0.1)
    assert differ.tolist() == [54, 55, 56]


def test_a_steady_turn_has_the_jerk_that_turns_its_acceleration() -> None:
    """Inputs 27 to 29 are the compressed -|a_n|^2 / |v|^2 v, over the sigma of the acceleration and the memory."""
    filtered, speed, rate = fake.run(np.random.default_rng(2)), 100.0, 0.2
    angle = rate * filtered.time_s
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    ahead = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    filtered.state[:, 3:6], filtered.state[:, 6:] = speed * ahead, -speed * rate * circle
    x, _ = named("motion").inputs(filtered, 0, 600)
    los = LineOfSight.of(filtered, 0, 600)
    memory_s = np.sqrt(np.mean(filtered.los_sigma[:, 3:] ** 2, axis=1)) / 0.3
    jerk = np.einsum("nij,nj->ni", los.axes, -(rate**2) * speed * ahead) * (memory_s / 0.3)[:, None]
    expected = np.sign(jerk) * np.log1p(np.abs(jerk))
    assert x[300:, 27:30] == pytest.approx(expected[300:], abs=0.05)


def test_the_errors_of_a_mount_are_linear_in_its_features() -> None:
    flown = simulate("manoeuvre-clean", seed=4, dt_s=0.1, duration_s=100.0, noise=(1e-3, 1e-7, 1e-7))
    errors = InstrumentErrors(
        servo_lag_s=0.02, servo_lag_s2=0.01, azimuth_eccentricity_rad=3e-4, azimuth_ellipticity_rad=2e-4,
        elevation_ellipticity_rad=2e-4, circle_zero_rad=0.4, collimation_rad=2e-4,
    )  # fmt: skip
    wrong = simulate("manoeuvre-clean", seed=4, dt_s=0.1, duration_s=100.0, noise=(0, 0, 0), instrument=errors)
    truth, seen = flown.truth, to_cartesian(wrong.log.measurement)
    assert truth.velocity_mps is not None
    acceleration = np.gradient(truth.velocity_mps, truth.time_s, axis=0)
    n = len(truth.time_s)
    state = np.concatenate([truth.position_m, truth.velocity_mps, acceleration], axis=1)
    features, run = named("mount"), fake.run(np.random.default_rng(0), n=n)._replace(state=state)
    x, valid = features.inputs(run, 0, n)
    los = LineOfSight.of(run, 0, n).rows(valid)
    error = np.concatenate([truth.position_m - seen, np.zeros((n, 6))], axis=1)[valid]
    target = features.targets(los, error)
    columns = np.concatenate([x[valid], np.ones((int(valid.sum()), 1))], axis=1)
    left = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    assert np.sqrt((target**2).mean(0))[1:].min() > 2e-4
    assert np.sqrt((left**2).mean(0))[1:].max() < 1e-5


def test_a_range_that_walks_is_linear_in_the_strength_of_its_echo() -> None:
    strength = np.linspace(-10.0, 50.0, 500)
    for detected_db in (13.0, 17.0):  # between the levels of the features
        walk = np.log1p(10 ** ((detected_db - strength) / 10))
        columns = np.concatenate([echo(strength), np.ones((500, 1))], axis=1)
        left = walk - columns @ np.linalg.lstsq(columns, walk, rcond=None)[0]
        assert np.abs(left).max() < 0.02 * walk.max()


def test_rows_without_a_strength_are_not_corrected() -> None:
    run = fake.run(np.random.default_rng(0))
    strength = np.full(600, 20.0)
    strength[300:310] = np.nan
    strength[310] = -1e300
    x, valid = named("echo").inputs(run, 100, 600, signal_db=strength)
    assert x.shape == (500, named("echo").input_size)
    assert np.flatnonzero(~valid).tolist() == list(range(200, 211))
    assert not named("echo").inputs(run, 100, 600)[1].any()
    without, same = named("mount").inputs(run, 100, 600)
    assert same.all()
    assert (x[valid][:, :22] == without[valid]).all()
