"""Places on the earth (WGS-84) in the east, north, up of an origin, each with its own vertical; plain numpy."""

from __future__ import annotations

import math

import numpy as np

from ftproc.records import FloatArray

RADIUS_M, ECCENTRICITY2 = 6378137.0, 6.69437999014131705734e-3  # of the ellipsoid: equatorial, and e^2

MEAN_RADIUS_M = 6.371e6

ROUNDS = 8  # of the search for a latitude: each gains three digits

Geodetic = tuple[float, float, float]  # latitude deg, longitude deg, height m


def earth_centred(place: Geodetic | FloatArray) -> FloatArray:
    """(3,) x, y, z in m, earth-centred and earth-fixed; or (3, n) of places (3, n)."""
    latitude, longitude = np.radians(place[:2])
    normal = RADIUS_M / np.sqrt(1 - ECCENTRICITY2 * np.sin(latitude) ** 2)
    across = (normal + place[2]) * np.cos(latitude)
    up = (normal * (1 - ECCENTRICITY2) + place[2]) * np.sin(latitude)
    return np.array([across * np.cos(longitude), across * np.sin(longitude), up])


def verticals(place: Geodetic) -> FloatArray:
    """(3, 3) whose rows are east, north and up there, earth-centred."""
    latitude, longitude = np.radians(place[:2])
    sp, cp, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    return np.array([[-sl, cl, 0.0], [-sp * cl, -sp * sl, cp], [cp * cl, cp * sl, sp]])


def seen_from(origin: Geodetic, place: Geodetic) -> tuple[FloatArray, FloatArray]:
    """(3,) east, north, up in m of a place at the origin, and (3, 3) rows: the place's own east, north, up there."""
    if tuple(origin) == tuple(place):
        return np.zeros(3), np.eye(3)
    at_origin = verticals(origin)
    return at_origin @ (earth_centred(place) - earth_centred(origin)), verticals(place) @ at_origin.T


def place_at(origin: Geodetic, position: FloatArray) -> Geodetic:
    """The place that is seen from an origin at (3,) east, north, up in m."""
    x, y, z = (float(v) for v in earth_centred(origin) + verticals(origin).T @ position)
    across = math.hypot(x, y)
    latitude = math.atan2(z, across * (1 - ECCENTRICITY2))
    for _ in range(ROUNDS):
        normal = RADIUS_M / math.sqrt(1 - ECCENTRICITY2 * math.sin(latitude) ** 2)
        latitude = math.atan2(z + ECCENTRICITY2 * normal * math.sin(latitude), across)
    normal = RADIUS_M / math.sqrt(1 - ECCENTRICITY2 * math.sin(latitude) ** 2)
    height = (
        across * math.cos(latitude) + z * math.sin(latitude) - normal * (1 - ECCENTRICITY2 * math.sin(latitude) ** 2)
    )
    return math.degrees(latitude), math.degrees(math.atan2(y, x)), height
