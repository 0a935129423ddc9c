"""What stations measure, and its derivatives."""

from __future__ import annotations

import numpy as np

from ftproc.core.model import stations
from tests import naive

RNG = np.random.default_rng(0)
STATE = np.hstack([RNG.normal(0, 4000, (20, 3)), RNG.normal(0, 200, (20, 3)), RNG.normal(0, 9, (20, 3))])
PLACE = RNG.normal(0, 2000, (20, 3))
AXES = np.array([np.linalg.qr(RNG.normal(size=(3, 3)))[0] for _ in range(20)])
AXES *= np.linalg.det(AXES)[:, None, None]


def slope(function, columns, step):
    """Central differences (n, 3, columns) of a function of (n, columns) at zero."""
    found = []
    for c in range(columns):
        move = np.zeros((20, columns))
        move[:, c] = step
        found.append(stations.innovation(function(move), function(-move)) / (2 * step))
    return np.stack(found, -1)


def test_measured_is_what_the_station_sees_in_its_axes():
    expected = [
        naive.measure(np.r_[axes @ (x[:3] - place), np.zeros(6)])
        for x, place, axes in zip(STATE, PLACE, AXES, strict=True)
    ]
    np.testing.assert_allclose(stations.measured(STATE[:, :3], PLACE, AXES), expected, rtol=1e-12)


def test_a_tilt_turns_the_axes():
    """By its angle, about its axis, right-handed."""
    tilt = RNG.normal(0, 0.5, (20, 2))
    turned = stations.levelled(AXES, tilt)
    turn = turned @ AXES.transpose(0, 2, 1)
    np.testing.assert_allclose(turn @ turn.transpose(0, 2, 1), np.tile(np.eye(3), (20, 1, 1)), atol=1e-12)
    about = np.c_[tilt, np.zeros(20)]
    np.testing.assert_allclose(np.einsum("nij,nj->ni", turn, about), about, atol=1e-12)
    np.testing.assert_allclose(np.trace(turn, axis1=1, axis2=2), 1 + 2 * np.cos(np.linalg.norm(tilt, axis=1)))
    np.testing.assert_allclose(stations.levelled(AXES, np.zeros((20, 2))), AXES)
    (quarter,) = stations.levelled(np.eye(3)[None], np.array([[np.pi / 2, 0.0]]))
    np.testing.assert_allclose(quarter @ [0, 1, 0], [0, 0, 1], atol=1e-12)


def test_jacobian_is_the_derivative_by_position():
    seen = stations.local(STATE[:, :3], PLACE, AXES)
    at = np.zeros((20, 3)), np.tile(np.eye(3), (20, 1, 1))
    np.testing.assert_allclose(
        stations.jacobian(seen), slope(lambda d: stations.measured(seen + d, *at), 3, 0.01), rtol=1e-5, atol=1e-9
    )


def test_near_the_zenith_the_derivatives_are_finite():
    assert np.isfinite(stations.jacobian(np.array([[0.0, 0.0, 1000.0], [1e-9, 0.0, 1000.0], [0.0, 0.0, 0.0]]))).all()


def test_design_is_the_derivative_by_tilts_and_clock():
    """Of what is written at a time: a clock that is ahead writes what was there before. The range does not know of
    the tilt."""

    def written(errors):
        position = STATE[:, :3] - errors[:, 2:] * STATE[:, 3:6]
        return stations.measured(position, PLACE, stations.levelled(AXES, errors[:, :2]))

    design = stations.design(STATE, PLACE, AXES)
    np.testing.assert_allclose(design, slope(written, 3, 1e-5), rtol=1e-5, atol=1e-4)
    assert not design[:, 0, :2].any()
