"""Places on the ellipsoid, against its textbook points and each other."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.model.earth import earth_centred, place_at, seen_from, verticals

EQUATOR_M, POLE_M = 6378137.0, 6356752.3142  # WGS-84: half axes
PLACES = [(48.0812, 11.2803, 612.0), (-33.9, 151.2, -20.0), (0.0, -179.99, 0.0), (89.0, 45.0, 3000.0)]


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        ((0.0, 0.0, 0.0), (EQUATOR_M, 0.0, 0.0)),
        ((0.0, 90.0, 100.0), (0.0, EQUATOR_M + 100, 0.0)),
        ((0.0, 180.0, -50.0), (50 - EQUATOR_M, 0.0, 0.0)),
        ((90.0, 0.0, 1000.0), (0.0, 0.0, POLE_M + 1000)),
        ((-90.0, 0.0, 0.0), (0.0, 0.0, -POLE_M)),
    ],
)
def test_textbook_points(place, expected):
    np.testing.assert_allclose(earth_centred(place), expected, atol=1e-3)


@pytest.mark.parametrize("place", PLACES)
def test_surface_is_the_ellipsoid_and_up_is_its_normal(place):
    x, y, z = earth_centred((*place[:2], 0.0))
    assert (x**2 + y**2) / EQUATOR_M**2 + z**2 / POLE_M**2 == pytest.approx(1, abs=1e-10)
    east, north, up = verticals(place)
    normal = np.array([x, y, z]) / np.array([EQUATOR_M, EQUATOR_M, POLE_M]) ** 2
    np.testing.assert_allclose(up, normal / np.linalg.norm(normal), atol=1e-10)
    np.testing.assert_allclose(np.cross(east, north), up, atol=1e-12)
    assert east[2] == 0.0
    assert north[2] > 0
    np.testing.assert_allclose(earth_centred((*place[:2], 250.0)) - (x, y, z), 250 * up, atol=1e-6)


@pytest.mark.parametrize("origin", PLACES)
@pytest.mark.parametrize("position", [(0.0, 0.0, 0.0), (5e4, -3e4, 8e3), (-2e5, 1e5, -3e3), (0.0, 0.0, 4e5)])
def test_a_place_is_seen_where_it_was_put(origin, position):
    place = place_at(origin, np.array(position))
    seen, axes = seen_from(origin, place)
    np.testing.assert_allclose(seen, position, atol=1e-5)
    np.testing.assert_allclose(axes, verticals(place) @ verticals(origin).T, atol=1e-12)


def test_what_an_origin_sees_of_itself():
    seen, axes = seen_from(PLACES[0], PLACES[0])
    np.testing.assert_array_equal(seen, 0.0)
    np.testing.assert_array_equal(axes, np.eye(3))
