"""The first state from the first readings that agree with each other."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.core.filtering.initialization import SAMPLES, _nearest, find_starts, first_start, first_state
from ftproc.core.filtering.records import Observations
from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.settings import FilterSettings
from tests.core.tracks import SIGMA, matched
from tests.simulated import simulate

NOISE = SIGMA**2


def straight(n=60, dt=0.1, position=(3000.0, -2000.0, 900.0), velocity=(-120.0, 60.0, 15.0), noise=0.0, seed=0):
    """time, readings and true states (n, 6) of a straight flight."""
    time = dt * np.arange(n)
    p = np.array(position) + time[:, None] * np.array(velocity)
    z = from_cartesian(p) + noise * SIGMA * np.random.default_rng(seed).standard_normal((n, 3))
    z[:, 1] = wrap(z[:, 1])
    return time, z, np.hstack([p, np.tile(velocity, (n, 1))])


def log(time, z, weight=None):
    """With every reading used that is there, unless weights say otherwise."""
    return Observations(time, z, np.isfinite(z).astype(float) if weight is None else weight)


def inside(start, truth, sigmas=1.0):
    """Whether the start holds the true position and velocity (6,) within so many of its own sigmas."""
    return (np.abs(start.state[:6] - truth) <= sigmas * np.sqrt(np.diag(start.covariance))[:6]).all()


@pytest.mark.parametrize(
    ("position", "velocity"),
    [
        ((3000.0, -2000.0, 900.0), (-120.0, 60.0, 15.0)),
        ((-4000.0, 3.0, 500.0), (10.0, -80.0, 0.0)),
        ((2e4, 2e4, 300.0), (0.0, 0.0, 0.0)),
        ((0.0, -6000.0, -50.0), (250.0, 0.0, 20.0)),
    ],
)
def test_straight_lines_are_recovered(position, velocity):
    time, z, truth = straight(position=position, velocity=velocity)
    start = first_start(log(time, z), NOISE)
    assert start.sample == 0
    assert (np.abs(start.state[6:]) <= np.sqrt(np.diag(start.covariance))[6:]).all()
    slant = np.linalg.norm(position)
    np.testing.assert_allclose(start.state[:3], position, atol=2e-3 * slant)
    np.testing.assert_allclose(start.state[3:6], velocity, atol=0.05 * np.linalg.norm(velocity) + 1)
    assert inside(start, truth[0])


def test_near_overhead_the_sigmas_hold_the_truth():
    time, z, truth = straight(position=(500.0, 0.0, 8000.0), velocity=(100.0, 200.0, 0.0))
    assert inside(first_start(log(time, z), NOISE), truth[0])


def test_sigmas_hold_the_truth_of_noisy_and_curved_flights():
    assert all(inside(first_start(log(*straight(noise=1.0, seed=s)[:2]), NOISE), straight()[2][0]) for s in range(50))
    for seed in range(20):
        a = matched(seed, 60, q=100.0)
        assert inside(first_start(a.log, NOISE), a.truth[0, :6])


def test_covariance_is_positive_definite_and_symmetric():
    time, z, _ = straight(noise=1.0)
    p = first_start(log(time, z), NOISE).covariance
    np.testing.assert_allclose(p, p.T, rtol=1e-12, atol=1e-9)
    assert np.linalg.eigvalsh(p).min() > 0


def test_wrong_first_samples_are_reached_back_over():
    time, z, truth = straight(noise=1.0)
    z[:8] += 500 * SIGMA
    weight = np.ones_like(z)
    weight[:8] = 0.0
    start = first_start(log(time, z, weight), NOISE)
    assert start.sample == 0
    assert inside(start, truth[0])


def test_far_reach_back_is_not_made():
    """When a component is first seen so late that nobody knows where the target was, the filter starts there."""
    time, z, truth = straight(n=320, noise=1.0)
    weight = np.ones_like(z)
    weight[:250, 2] = 0.0
    start = first_start(log(time, z, weight), NOISE)
    assert start.sample == 250
    assert inside(start, truth[250])


def test_a_turn_is_no_straight_line():
    """The first state of a turning target has its acceleration, of a close one too."""
    for scale in (1.0, 1e-3):
        time = 0.1 * np.arange(40)
        angle = 0.4 * time
        p = scale * np.stack([3000 + 500 * np.cos(angle), 500 * np.sin(angle), 0 * angle + 300], 1)
        start = first_start(log(time, from_cartesian(p)), NOISE * np.array([scale**2, 1.0, 1.0]))
        sigma = np.sqrt(np.diag(start.covariance))
        truth = scale * np.r_[3500, 0, 300, 0, 200, 0, -80, 0, 0]
        assert (np.abs(start.state - truth) <= 1.5 * sigma).all()


def test_components_need_not_come_at_the_same_instants():
    time, z, truth = straight(n=90, noise=1.0)
    for c in range(3):
        z[np.arange(90) % 3 != c, c] = np.nan
    start = first_start(log(time, z), NOISE)
    assert inside(start, truth[start.sample])
    np.testing.assert_allclose(start.state[3:6], truth[0, 3:], atol=15)


def test_single_sample():
    z = from_cartesian(np.array([[3000.0, 400.0, 500.0]]))
    start = first_start(log(np.zeros(1), z), NOISE)
    np.testing.assert_allclose(start.state[:3], [3000, 400, 500], rtol=1e-12)
    assert not start.state[3:].any()
    assert np.sqrt(np.diag(start.covariance))[3:6].min() >= 1000.0  # nothing is known of the velocity but the range
    assert np.linalg.eigvalsh(start.covariance).min() > 0


def test_two_samples_and_one_instant():
    time, z, truth = straight(n=2, dt=1.0)
    start = first_start(log(time, z), NOISE)
    assert inside(start, truth[0])
    np.testing.assert_allclose(start.state[3:6], truth[0, 3:], rtol=0.05, atol=2)
    same = first_start(log(np.zeros(2), z[[0, 0]]), NOISE)
    assert np.isfinite(same.covariance).all()


def test_azimuth_across_the_cut():
    time, z, truth = straight(position=(-5000.0, 10.0, 400.0), velocity=(0.0, -100.0, 0.0))
    assert np.ptp(z[:15, 1]) > 6
    start = first_start(log(time, z), NOISE)
    assert inside(start, truth[0])
    np.testing.assert_allclose(start.state[3:6], truth[0, 3:], atol=2)


@pytest.mark.parametrize("component", range(3))
def test_component_without_a_good_reading_is_named(component):
    time, z, _ = straight()
    weight = np.ones_like(z)
    weight[:, component] = 0.0
    with pytest.raises(ValueError, match=rf"^{component}$"):
        first_start(log(time, z, weight), NOISE)
    with pytest.raises(ValueError, match=rf"^{component}$"):
        first_state(log(time, z, weight), NOISE, 10, slice(0, 20))


def test_first_state_uses_its_span_only():
    time, z, truth = straight(n=100)
    spoiled = z.copy()
    spoiled[:40] += 1.0
    spoiled[60:] -= 1.0
    one = first_state(log(time, z), NOISE, 50, slice(40, 60))
    other = first_state(log(time, spoiled), NOISE, 50, slice(40, 60))
    np.testing.assert_array_equal(one.state, other.state)
    assert one.sample == 50
    assert inside(one, truth[50])


def test_position_sigma_stays_well_below_the_range():
    z = from_cartesian(np.array([[40.0, 30.0, 10.0]]))
    start = first_start(log(np.zeros(1), z), np.array([1e4, 1.0, 1.0]))
    assert np.sqrt(np.linalg.eigvalsh(start.covariance[:3, :3]).max()) < 0.5 * 51


def nearest_reference(time, good, sample, first, last):
    """The nearest readings by sorting all of them."""
    found = np.flatnonzero(good[first:last]) + first
    here = int(np.searchsorted(found, sample))
    found = found[max(here - SAMPLES, 0) : here + SAMPLES]
    away = np.abs(time[found] - time[sample])
    order = np.argsort(away, kind="stable")[:SAMPLES]
    return np.sort(found[order])


def test_the_nearest_readings_are_chosen():
    rng = np.random.default_rng(21)
    for _ in range(200):
        n = int(rng.integers(1, 60))
        time = np.cumsum(rng.choice([0.1, 1.0, 5.0, 30.0], n))
        weight, z = rng.choice([0.0, 1.0, 1.0], (n, 3)), rng.normal(size=(n, 3))
        z[rng.random((n, 3)) < 0.2] = np.nan
        first, last = sorted(rng.integers(0, n + 1, 2))
        good = (weight[:, 1] > 0) & np.isfinite(z[:, 1])
        if good[first:last].any():
            sample = int(rng.integers(first, last))
            found = _nearest(time, z, weight, sample, int(first), int(last), 1)
            np.testing.assert_array_equal(found, nearest_reference(time, good, sample, first, last))


def interrupted(gap, n=80, after=60):
    """A straight flight with a gap of so many seconds after n samples."""
    time = 0.1 * np.arange(n + after)
    time[n:] += gap
    p = np.array([6000.0, -2000.0, 900.0]) + time[:, None] * np.array([-60.0, 30.0, 0.0])
    z = from_cartesian(p) + SIGMA * np.random.default_rng(3).standard_normal((n + after, 3))
    z[:, 1] = wrap(z[:, 1])
    return time, z, np.hstack([p, np.tile([-60.0, 30.0, 0.0], (n + after, 1))])


@pytest.mark.parametrize(
    ("gap", "jerk", "again"),
    [(0.0, 10.0, False), (4.0, 10.0, False), (30.0, 1e-3, False), (30.0, 10.0, True), (300.0, 1e-3, True)],
)  # fmt: skip
def test_filter_is_re_initialized_after_a_gap_too_long_to_coast(gap, jerk, again):
    """The position becomes uncertain by sqrt(q gap^5 / 20)."""
    time, z, truth = interrupted(gap)
    starts = find_starts(log(time, z), NOISE, jerk)
    assert [start.sample for start in starts] == ([0, 80] if again else [0])
    for start in starts:
        assert inside(start, truth[start.sample])


@pytest.mark.parametrize("missing", [(), (0,), (1, 2)])
def test_gaps_that_cannot_matter_are_not_looked_at(monkeypatch, missing):
    """What the nearest range and the longest gap tell at once is what all gaps and ranges tell."""
    from ftproc.core.filtering import initialization

    whole, found = initialization._extremes, []
    for gap in np.geomspace(3.0, 100.0, 25):
        time, z, _ = interrupted(float(gap))
        z[60:80, missing] = np.nan
        for bound in (whole, lambda *log: (*whole(*log)[:2], 0.0)):  # of a target that may be here: it may matter
            monkeypatch.setattr(initialization, "_extremes", bound)
            found.append([start.sample for start in find_starts(log(time, z), NOISE, 10.0)])
    assert found[::2] == found[1::2]
    assert [0] in found
    assert [0, 80] in found


def test_the_process_noise_beside_a_gap_counts_if_it_is_more():
    """That of the log does not say what an agile target may do in a gap of a turn; components that are blind for a
    while, of which the decisions may change, go by that of the log."""
    time, z, _ = interrupted(20.0)
    level = np.full(len(time), 1e-3)
    level[75:85] = 1e3
    for most, starts in ((None, [0]), (level, [0, 80]), (np.roll(level, 40), [0]), (level / 1e9, [0])):
        assert [start.sample for start in find_starts(log(time, z), NOISE, 1e-3, most)] == starts
    time, z, _ = interrupted(0.1, n=300, after=100)
    z[100:300, 1] = np.nan
    assert len(find_starts(log(time, z), NOISE, 1e-3, np.full(len(time), 1e3))) == 1


def test_too_few_readings_after_a_gap_are_no_start():
    time, z, _ = interrupted(300.0, after=5)
    assert len(find_starts(log(time, z), NOISE, 10.0)) == 1
    time, z, _ = interrupted(300.0)
    z[84:, 1] = np.nan
    assert len(find_starts(log(time, z), NOISE, 10.0)) == 1


def test_start_after_a_gap_rests_on_its_own_side_only():
    time, z, _ = interrupted(300.0)
    spoiled = z.copy()
    spoiled[:80] += 0.05
    one, other = (find_starts(log(time, readings), NOISE, 10.0)[1] for readings in (z, spoiled))
    np.testing.assert_array_equal(one.state, other.state)


@pytest.mark.parametrize(("seconds", "jerk", "again"), [(4.0, 100.0, False), (20.0, 1e-3, False), (20.0, 100.0, True)])
@pytest.mark.parametrize("component", range(3))
def test_filter_is_re_initialized_after_one_component_was_blind_too_long(component, seconds, jerk, again):
    """The others hold the track, so the gap may be longer; a filter that comes out of it would be lost."""
    time, z, truth = interrupted(0.1, n=300, after=100)
    z[300 - round(seconds / 0.1) : 300, component] = np.nan
    starts = find_starts(log(time, z), NOISE, jerk)
    assert [start.sample for start in starts] == ([0, 300] if again else [0])
    for start in starts:
        assert inside(start, truth[start.sample])


@pytest.mark.compiled
@pytest.mark.slow
def test_flights_with_blind_turns_do_not_run_away():
    """5 g turns seen once a second, with patches of half a minute, which are too long to coast through. What becomes of
    one such flight may hang on the last digit of a reading; what becomes of most does not."""
    middle, far = [], []
    for seed in range(14, 17):
        flight = simulate("manoeuvre", seed=seed, dt_s=1.0, duration_s=600.0, outliers="patch=3:10-30:10-50")
        found = pipeline.filter_log(flight.log, FilterSettings(smooth=True))
        error = np.linalg.norm(found.state[:, :3] - flight.truth.position_m, axis=1)
        middle.append(np.median(error))
        far.append(np.quantile(error, 0.9))
    assert np.median(middle) < 5
    assert np.median(far) < 200
