"""R, A, E <-> x, y, z: tables of the edges, round trips, axes and the Jacobian of Zuo et al. 2021 eq. 4."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.model import frames
from ftproc.core.model.jacobian import jacobian
from tests import naive

PI = np.pi
ROOT = 2**0.5


@pytest.mark.parametrize(
    ("position", "measurement"),
    [
        ((1000, 0, 0), (1000, 0, 0)),
        ((-1000, 0.0, 0), (1000, PI, 0)),
        ((-1000, -0.0, 0), (1000, -PI, 0)),
        ((0, 1000, 0), (1000, PI / 2, 0)),
        ((0, -1000, 0), (1000, -PI / 2, 0)),
        ((3, 3, 0), (3 * ROOT, PI / 4, 0)),
        ((-3, 3, 0), (3 * ROOT, 3 * PI / 4, 0)),
        ((-3, -3, 0), (3 * ROOT, -3 * PI / 4, 0)),
        ((3, -3, 0), (3 * ROOT, -PI / 4, 0)),
        ((0, 0, 500), (500, 0, PI / 2)),
        ((0, 0, -500), (500, 0, -PI / 2)),
        ((300, 400, 500), (500 * ROOT, np.arctan2(4, 3), PI / 4)),
        ((300, 400, -500), (500 * ROOT, np.arctan2(4, 3), -PI / 4)),
        ((-1e7, -1e7, 1e-3), (1e7 * ROOT, -3 * PI / 4, 1e-3 / (1e7 * ROOT))),
        ((0, 0, 0), (0, 0, 0)),
    ],
)
def test_edge_geometry(position, measurement):
    """Quadrants, the cut from both sides, straight up and straight down."""
    np.testing.assert_allclose(frames.from_cartesian(np.array(position, float)), measurement, rtol=1e-15, atol=0)
    np.testing.assert_allclose(
        frames.to_cartesian(np.array(measurement, float)), position, rtol=1e-14, atol=1e-15 * measurement[0]
    )


def test_round_trip_of_random_positions():
    position = np.random.default_rng(1).normal(0, 1, (500, 3)) * 10.0 ** np.linspace(-2, 7, 500)[:, None]
    back = frames.to_cartesian(frames.from_cartesian(position))
    error = np.linalg.norm(back - position, axis=1) / np.linalg.norm(position, axis=1)
    assert error.max() < 1e-15


def test_missing_component_spoils_only_what_rests_on_it():
    measurement = np.array([[np.nan, 0.1, 0.2], [100.0, np.nan, 0.2], [100.0, 0.1, np.nan]])
    np.testing.assert_array_equal(
        np.isnan(frames.to_cartesian(measurement)),
        [[True, True, True], [True, True, False], [True, True, True]],
    )


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [(0, 0), (PI, -PI), (-PI, -PI), (3 * PI, -PI), (PI + 0.25, -PI + 0.25), (-PI - 0.25, PI - 0.25), (7.0, 7 - 2 * PI)],
)
def test_wrap_at_the_cut(angle, wrapped):
    assert frames.wrap(np.array([float(angle)]))[0] == pytest.approx(wrapped, abs=1e-14)


def test_wrap_is_in_its_interval_and_keeps_the_direction():
    angle = np.random.default_rng(2).uniform(-50, 50, 2000)
    wrapped = frames.wrap(angle)
    assert ((wrapped >= -PI) & (wrapped < PI)).all()
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * angle), atol=1e-13)


def test_unwrap_takes_out_whole_turns_and_steps_over_missing_readings():
    true = np.linspace(0, 25, 300)
    azimuth = frames.wrap(true)
    azimuth[[0, 7, 8, 9, 100, 299]] = np.nan
    unwrapped = frames.unwrap(azimuth)
    np.testing.assert_array_equal(np.isnan(unwrapped), np.isnan(azimuth))
    seen = np.isfinite(azimuth)
    np.testing.assert_allclose(unwrapped[seen], true[seen], atol=1e-13)
    assert np.isnan(azimuth[0])  # the argument is not changed


def test_line_of_sight_axes_are_a_right_handed_frame():
    position = np.random.default_rng(3).normal(0, 1000, (50, 3))
    axes = frames.line_of_sight_axes(position)
    np.testing.assert_allclose(axes @ np.swapaxes(axes, 1, 2), np.tile(np.eye(3), (50, 1, 1)), atol=1e-15)
    np.testing.assert_allclose(np.linalg.det(axes), 1, atol=1e-14)
    slant = np.linalg.norm(position, axis=1)
    np.testing.assert_allclose(axes[:, 0] * slant[:, None], position, rtol=1e-12)


def test_cross_points_to_growing_azimuth_and_up_to_growing_elevation():
    position = np.array([[300.0, -400.0, 200.0]])
    r, a, e = frames.from_cartesian(position)[0]
    axes = frames.line_of_sight_axes(position)[0]
    for step, axis, arm in (((0, 1e-6, 0), 1, r * np.cos(e)), ((0, 0, 1e-6), 2, r)):
        moved = frames.to_cartesian(np.array([r, a, e]) + step) - position[0]
        np.testing.assert_allclose(moved, 1e-6 * arm * axes[axis], atol=1e-6 * arm * 1e-5)


def test_jacobian_of_eq_4_against_finite_differences():
    rng = np.random.default_rng(4)
    h = np.zeros((3, 3))
    for _ in range(200):
        x = np.r_[rng.normal(0, 1, 3) * 10 ** rng.uniform(1, 5), rng.normal(0, 100, 6)]
        jacobian(x, h)
        scale = np.array([1.0, 1 / np.hypot(x[0], x[1]), 1 / np.linalg.norm(x[:3])])[:, None]
        np.testing.assert_allclose(h / scale, naive.jacobian(x)[:, :3] / scale, atol=1e-6)


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_jacobian_stays_finite_straight_overhead(up):
    h = np.full((3, 3), np.nan)
    jacobian(np.r_[0.0, 0.0, up * 5000.0, np.zeros(6)], h)
    assert np.isfinite(h).all()
    assert h[0] == pytest.approx([0, 0, up])
    assert np.abs(h[1]).max() <= 1 / 5.0  # as if 1e-3 of the range off the zenith


def test_jacobian_at_the_station_is_finite():
    h = np.full((3, 3), np.nan)
    jacobian(np.zeros(9), h)
    assert np.isfinite(h).all()


@pytest.mark.parametrize("position", [(3e3, 4e3, 5e3), (-2e3, 1e2, -3e3), (1e4, 0, 0)])
def test_sigma_of_a_reading_is_that_of_the_jacobian_far_from_the_vertical(position):
    place = np.array(position, float)
    root = np.random.default_rng(0).normal(size=(3, 3))
    covariance = root @ root.T
    (axes,) = frames.line_of_sight_axes(place[None])
    h = np.empty((3, 3))
    jacobian(place, h)
    along = np.sqrt(np.diag(axes @ covariance @ axes.T))
    (found,) = frames.measurement_sigma(frames.from_cartesian(place[None]), along[None])
    np.testing.assert_allclose(found, np.sqrt(np.diag(h @ covariance @ h.T)), rtol=1e-4)


@pytest.mark.parametrize("ground_sigmas", [0.0, 0.5, 2.0, 4.0, 10.0, 100.0])
def test_sigma_of_an_azimuth_near_the_zenith_covers_it(ground_sigmas):
    """The true azimuth of positions of which a 1-sigma of 1 m is known, by drawing them."""
    around = np.array([ground_sigmas, 0.0, 1000.0]) + np.random.default_rng(1).normal(size=(20_000, 3))
    seen = frames.from_cartesian(np.array([[ground_sigmas, 0.0, 1000.0]]))
    ((_, azimuth, elevation),) = frames.measurement_sigma(seen, np.ones((1, 3)))
    off = np.abs(frames.wrap(frames.from_cartesian(around)[:, 1] - seen[0, 1]))
    assert (off <= 3 * azimuth).mean() > 0.995
    assert azimuth <= frames.ANY_ANGLE_RAD
    assert elevation == pytest.approx(1e-3, rel=1e-2)


def test_no_estimate_has_no_sigma_of_a_reading():
    nothing = np.full((2, 3), np.nan)
    assert np.isnan(frames.measurement_sigma(nothing, nothing)).all()
