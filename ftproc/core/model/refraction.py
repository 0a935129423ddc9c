"""Atmospheric refraction of light: how much higher a target seems than it is. Plain numpy.

The air is taken in spherical layers whose refractivity n - 1 falls off exponentially with height. A nearly
horizontal ray bends down by -dn/dh cos(E) per metre, so a target at distance R along it appears higher by

    dE = 1/R  integral from 0 to R of  (R - s) * (n0 - 1)/H * exp(-h(s)/H) * cos(E(s))  ds

(the angle of refraction of geodesy: F. K. Brunner, ed., Geodetic Refraction, 1984), with h(s) and E(s) along the
straight ray over a spherical earth. For a star it becomes the textbook's (n0 - 1) cot(E), for a near target
(n0 - 1) R cos(E) / 2H. It is of first order in n - 1: good to a per cent or so above two degrees of elevation.
"""

from __future__ import annotations

import numpy as np

from ftproc.records import FloatArray

EARTH_M = 6.371e6
REFRACTIVITY = 2.778e-4  # n - 1 of green light (0.55 um) at 15 deg C, 1013.25 hPa: Edlen 1966, dry air
KELVIN, STANDARD_K, STANDARD_HPA = 273.15, 288.15, 1013.25
HYDROSTATIC_K_PER_M = 0.03416  # g / R of dry air: how fast pressure falls off, times the temperature
LAPSE_K_PER_M = 0.0065  # of the standard atmosphere
THINNEST = 15.0  # scale heights above which nothing bends any more
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


def elevation_error(
    range_m: FloatArray, elevation_rad: FloatArray, temperature_c: float, pressure_hpa: float
) -> FloatArray:
    """(n,) observed minus true elevation in rad; range inf for a target outside the air, NaN gives NaN.

    temperature_c, pressure_hpa: of the air at the station, not reduced to sea level.
    """
    kelvin = temperature_c + KELVIN
    surface = REFRACTIVITY * (pressure_hpa / STANDARD_HPA) * (STANDARD_K / kelvin)
    scale_m = kelvin / (HYDROSTATIC_K_PER_M - LAPSE_K_PER_M)  # of the density near the ground
    length = np.minimum(range_m, _way_out(elevation_rad, THINNEST * scale_m))
    sine, cosine = np.sin(elevation_rad), np.cos(elevation_rad)
    error = np.zeros_like(elevation_rad)
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        s = length * (node + 1) / 2
        radius = np.sqrt(EARTH_M**2 + s * (s + 2 * EARTH_M * sine))
        bending = surface / scale_m * np.exp((EARTH_M - radius) / scale_m) * cosine * EARTH_M / radius
        still_to_go = 1 - s / np.maximum(range_m, 1.0)  # within the first metre nothing bends
        error += weight * bending * still_to_go
    return error * length / 2


def _way_out(elevation_rad: FloatArray, height_m: float) -> FloatArray:
    """How far it is along the ray to a height, in m."""
    rise = EARTH_M * np.sin(elevation_rad)
    return np.sqrt(rise**2 + height_m * (height_m + 2 * EARTH_M)) - rise
