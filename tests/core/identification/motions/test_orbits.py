"""Satellites over a turning earth, flown here by their equations in an integrator of scipy, with J2."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ftproc import pipeline
from ftproc.core.identification.motions import orbits
from ftproc.core.identification.motions.orbits import EARTH_RADPS, _direction, _rotation
from ftproc.core.model.frames import from_cartesian
from ftproc.records import MeasurementLog
from ftproc.settings import FilterSettings

pytestmark = pytest.mark.compiled

EARTH_M, EQUATOR_M, MU_M3PS2, J2 = 6371008.8, 6378137.0, 3.986004418e14, 1.08263e-3
LOWEST_RAD = 0.14  # over the horizon
SMOOTH = FilterSettings(smooth=True)
#: height m, s of a pass, s between readings, 1-sigma m and rad, share of outliers in range (where readings are minutes
#: apart, white jerk hides them), times of white jerk's errors of position and velocity.
PASSES = [
    (500e3, 500, 0.5, 5.0, 1e-4, 0.02, 0.8, 0.3),
    (1200e3, 900, 5.0, 3.0, 5e-5, 0.02, 0.9, 0.5),
    (6000e3, 4000, 30.0, 4.0, 1e-4, 0.0, 0.6, 0.2),
    (20000e3, 9000, 120.0, 5.0, 3e-5, 0.0, 0.6, 0.1),
]


def passed(draw, height_m, lasts_s, dt_s, range_m, angle_rad, outliers):
    """A log with outliers in range, and its truth (n, 6)."""
    latitude, north, along, off = draw.uniform((-1.0, 0.0, 0.0, -0.1), (1.2, 6.3, 6.3, 0.1))
    turn = EARTH_RADPS * np.array(
        [np.cos(latitude) * np.cos(north), np.cos(latitude) * np.sin(north), np.sin(latitude)]
    )
    axis = turn / EARTH_RADPS
    ahead, aside = np.array([np.cos(along), np.sin(along), 0]), np.array([-np.sin(along), np.cos(along), 0])
    begin = (EARTH_M + height_m) * (np.cos(off) * np.array([0, 0, 1]) + np.sin(off) * aside)
    speed = np.sqrt(MU_M3PS2 / (EARTH_M + height_m) * (1 + draw.uniform(0, 0.02)))

    def flow(_, state):
        x, v = state[:3], state[3:]
        r, up = np.linalg.norm(x), x @ axis
        flat = 1.5 * J2 * MU_M3PS2 * EQUATOR_M**2 / r**5 * ((1 - 5 * up**2 / r**2) * x + 2 * up * axis)
        pull = -MU_M3PS2 * x / r**3 - flat
        return np.concatenate([v, pull - 2 * np.cross(turn, v) - np.cross(turn, np.cross(turn, x))])

    t = np.arange(0, lasts_s, dt_s) - lasts_s / 2
    first = np.concatenate([begin, speed * ahead - np.cross(turn, begin)])
    sides = [solve_ivp(flow, (0, end), first, "DOP853", rtol=1e-11, dense_output=True).sol for end in (t[0], t[-1])]
    state = np.where(t < 0, sides[0](np.minimum(t, 0)), sides[1](np.maximum(t, 0))).T
    state[:, 2] -= EARTH_M
    reading = from_cartesian(state[:, :3])
    state, t, reading = (each[reading[:, 2] > LOWEST_RAD] for each in (state, t, reading))
    reading += draw.standard_normal(reading.shape) * [range_m, angle_rad, angle_rad]
    reading[draw.random(len(t)) < outliers, 0] += 50 * range_m
    return MeasurementLog("a pass", t - t[0], reading, np.arange(len(t))), state


@pytest.mark.parametrize("seed", range(len(PASSES)))
def test_a_satellite_is_moved_by_gravity(seed):
    *what, nearer, slower = PASSES[seed]
    log, truth = passed(np.random.default_rng(seed), *what)
    white, found = (pipeline.filter_log(log, replace(SMOOTH, motion=motion)) for motion in ("white-jerk", "auto"))
    summary = found.metadata["summary"]
    assert summary["motion"] == "orbital"
    assert summary["trust"]["verdict"] == "consistent"
    assert 1 / 3 < summary["components"]["range"]["noise_m"] / what[3] < 3
    off = found.state[:, :6] - truth
    assert (np.abs(off) < 3 * found.sigma[:, :6]).mean() > 0.98
    before, after = (((one.state[:, :6] - truth) ** 2).reshape(-1, 2, 3).sum(2).mean(0) for one in (white, found))
    assert (np.sqrt(after / before) < (nearer, slower)).all()


@pytest.mark.parametrize(("of", "seed", "farthest_m"), [(3, 53, 600), (2, 12, 4000)])
def test_the_course_about_which_gravity_is_followed_may_begin_far_off(of, seed, farthest_m):
    """Ranges in every third row, and without angles, of the later half of a pass: white jerk is 127 km off, and an
    orbit from one start of the earth's axis 170."""
    log, truth = passed(np.random.default_rng(seed), *PASSES[of][:5], 0.0)
    measurement, row = log.measurement.copy(), np.arange(len(log))
    ranged = (row % 3 == 0) & (row > len(log) / 2)
    measurement[~ranged, 0], measurement[ranged, 1:] = np.nan, np.nan
    found = pipeline.filter_log(replace(log, measurement=measurement), SMOOTH)
    assert found.metadata["summary"]["motion"] == "orbital"
    assert np.abs(found.state[:, :3] - truth[:, :3]).max() < farthest_m


def test_what_flies_in_the_air_is_in_no_orbit():
    course = np.zeros((10, 9))
    assert not orbits.may_be(course)
    course[:, 0] = 500e3  # where the ground is 20 km lower
    assert not orbits.may_be(course)
    course[:, 2] = 200e3
    assert orbits.may_be(course)


@pytest.mark.parametrize("direction", [(0.7, 1.2), (-1.0, -2.0), (0.0, 3.0)])
def test_directions_of_the_earths_axis(direction):
    rotation = _rotation(np.array(direction))
    assert np.linalg.norm(rotation) == pytest.approx(EARTH_RADPS)
    np.testing.assert_allclose(_direction(rotation), direction, atol=1e-12)
