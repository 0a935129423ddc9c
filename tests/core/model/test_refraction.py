"""Refraction of light against rays traced through the same air, and against the textbook's limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ftproc.core.model import refraction

SCALE_M = refraction.STANDARD_K / (refraction.HYDROSTATIC_K_PER_M - refraction.LAPSE_K_PER_M)


def error(range_m, elevation_deg, temperature_c=15.0, pressure_hpa=1013.25):
    given = np.array([float(range_m)]), np.deg2rad([float(elevation_deg)])
    return refraction.elevation_error(*given, temperature_c, pressure_hpa)[0]


def traced(range_m, elevation_deg):
    """The ray equation d/ds(n t) = grad n in spherical layers, from the station along the observed direction."""

    def slope(_, y):
        x, z, u, v = y
        radius = math.hypot(x, z + refraction.EARTH_M)
        thin = refraction.REFRACTIVITY * math.exp((refraction.EARTH_M - radius) / SCALE_M)
        gx, gz = (-thin / SCALE_M * part / radius for part in (x, z + refraction.EARTH_M))
        along = gx * u + gz * v
        return u, v, (gx - along * u) / (1 + thin), (gz - along * v) / (1 + thin)

    e = math.radians(elevation_deg)
    x, z = solve_ivp(slope, (0, range_m), [0, 0, math.cos(e), math.sin(e)], rtol=1e-11, atol=1e-9).y[:2, -1]
    return e - math.atan2(z, x)


@pytest.mark.parametrize("elevation_deg", [0.5, 2.0, 10.0, 45.0, 80.0])
@pytest.mark.parametrize(("range_m", "within"), [(500.0, 1e-3), (20e3, 1e-3), (100e3, 4e-3), (400e3, 0.025)])
def test_against_a_traced_ray(range_m, within, elevation_deg):
    assert error(range_m, elevation_deg) == pytest.approx(traced(range_m, elevation_deg), rel=within)


@pytest.mark.parametrize("elevation_deg", [20.0, 45.0, 70.0])
def test_a_star_is_the_textbook_s(elevation_deg):
    """dE = (n0 - 1) cot E; a spherical earth takes a per cent off at 20 degrees."""
    expected = refraction.REFRACTIVITY / math.tan(math.radians(elevation_deg))
    assert error(math.inf, elevation_deg) == pytest.approx(expected, rel=0.015)


def test_a_near_target_is_the_surveyor_s():
    """dE = k R / 2 r with k = 0.17 in the standard atmosphere (Gauss measured 0.13 near the ground)."""
    assert error(1000.0, 0.0) == pytest.approx(0.17 * 1000 / (2 * refraction.EARTH_M), rel=0.01)


def test_air():
    assert error(1e5, 10.0, 15.0, 500.0) == pytest.approx(error(1e5, 10.0) * 500 / 1013.25, rel=1e-12)
    far = error(math.inf, 45.0, 35.0) / error(math.inf, 45.0)
    assert far == pytest.approx(288.15 / 308.15, rel=1e-3)


def test_refractivity_is_edlen_s():
    """Edlen 1966, dry air of 15 deg C at 1013.25 hPa, wave number in 1/um."""
    k2 = (1 / 0.55) ** 2
    assert pytest.approx((8342.13 + 2406030 / (130 - k2) + 15997 / (38.9 - k2)) * 1e-8, rel=1e-4) == (
        refraction.REFRACTIVITY
    )


def test_straight_up_at_the_station_below_it_and_missing():
    assert error(1e5, 90.0) == pytest.approx(0.0, abs=1e-15)
    assert error(0.0, 30.0) == 0.0
    assert 0 < error(1000.0, -20.0) < 1e-4
    assert math.isnan(error(math.nan, 10.0))
    assert math.isnan(error(1e5, math.nan))


def test_many_at_once():
    range_m, elevation_deg = np.array([1e3, 2e4, math.inf]), np.array([3.0, 50.0, 20.0])
    together = refraction.elevation_error(range_m, np.deg2rad(elevation_deg), 15.0, 1013.25)
    assert together == pytest.approx([error(*one) for one in zip(range_m, elevation_deg, strict=True)], rel=1e-14)
